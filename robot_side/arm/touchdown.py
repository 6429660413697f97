"""Detection of a held object's touchdown on something: the arm then carries less of the weight than before.

    carried ─▶ stands ─▶ carried
            │         └ the tool has risen by 3 mm, or the object is released
            └ the tool is commanded to sink, and the load has fallen by more than 5 N plus half of the weight

The robot side then stops motion downwards, and relaxes the torque that the drives have built up.
"""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.resolved_rate import joint_velocities

_BORNE_N: Final = 5.0
"""Fall of the load that shows a touchdown, in N: larger than the change within a second of a measured load's error."""
_BORNE_SHARE: Final = 0.5
"""Further fall of the load that shows a touchdown, as a share of the weight. A tool that starts to sink accelerates by
less than half of g, so the arm still carries more than half of the weight."""
_HARDLY: Final = 0.25
_STALLED_S: Final = 0.15
"""Time, in seconds, after which a tool without measured loads counts as standing, if it sinks at less than a quarter of
the commanded speed. An arm needs less time to begin to move."""
_SINKS_M_S: Final = 1e-3
_LEAVES_M: Final = 3e-3
_GIVES_WAY_S: Final = 0.01
"""Time, in seconds, for which the arm halts at its measured position: longer than a step of physics or
of a controller"""
_NOISE_S: Final = 0.01
_USUAL_S: Final = 1.0
"""Time constants, in seconds, of the present load (`_NOISE_S`) and of the usual load (`_USUAL_S`). The usual load
follows a lift, and errors of the arm's model."""
_SPEED_S: Final = 0.03
"""Time constant of the measured speed, in seconds"""
_UP: Final = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def carried_n(tool_jacobian: FloatArray, joint_loads_nm: FloatArray | None) -> float | None:
    """Return the upward force in N that drives with these loads (n,) exert at the tool; None without loads.

    By virtual work. tool_jacobian (6, n), linear rows first.
    """
    if joint_loads_nm is None or not np.isfinite(joint_loads_nm).all():
        return None
    return float(joint_loads_nm @ joint_velocities(tool_jacobian, _UP, np.full(joint_loads_nm.size, np.inf)))


class Touchdown:
    """State of one held object, from grip to release: carried, or standing on something."""

    def __init__(self) -> None:
        self.stands = False
        self._since_s = self._time_s = -math.inf
        self._height_m = self._sinks_m_s = self._stalled_s = 0.0
        self._carried_n = self._usual_n = 0.0

    @property
    def gives_way(self) -> bool:
        """Whether the object has just touched down"""
        return self.stands and self._time_s - self._since_s < _GIVES_WAY_S

    def update(self, carried_n: float | None, height_m: float, rises_m_s: float, time_s: float) -> None:
        """Take the load (None if unknown) and the tool's height, both measured at `time_s`.

        rises_m_s: commanded speed of the tool upwards since the last update.
        """
        passed_s, sunk_m = time_s - self._time_s, self._height_m - height_m
        if passed_s <= 0.0:
            return
        first, self._time_s = passed_s == math.inf, time_s
        if self.stands:
            self._height_m = min(self._height_m, height_m)
            self.stands = height_m - self._height_m < _LEAVES_M
            self._carried_n = self._usual_n  # for when it is lifted
            return
        self._height_m = height_m
        if first:
            self._carried_n = self._usual_n = carried_n or 0.0
        elif carried_n is None:
            self._sinks_m_s += (sunk_m / passed_s - self._sinks_m_s) * -math.expm1(-passed_s / _SPEED_S)
            sinks = rises_m_s > -_SINKS_M_S or self._sinks_m_s > -_HARDLY * rises_m_s
            self._stalled_s = 0.0 if sinks else self._stalled_s + passed_s
        else:
            self._carried_n += (carried_n - self._carried_n) * -math.expm1(-passed_s / _NOISE_S)
            self._usual_n += (carried_n - self._usual_n) * -math.expm1(-passed_s / _USUAL_S)
        borne_n = self._usual_n - self._carried_n
        borne = borne_n > _BORNE_N + _BORNE_SHARE * max(0.0, self._usual_n)
        if rises_m_s < -_SINKS_M_S and (borne or self._stalled_s > _STALLED_S):
            self.stands, self._since_s, self._stalled_s = True, time_s, 0.0
