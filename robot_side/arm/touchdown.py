"""Detection of a held object's touchdown on something: the arm then carries less of the weight than before.

    carried ─▶ stands ─▶ carried
            │         └ the tool has risen by 3 mm, or the object is released
            └ the tool is commanded to sink, and the load has fallen by more than 5 N and half of the weight

The robot side then stops motion downwards, and relaxes the torque that the drives have built up.
"""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.resolved_rate import joint_velocities

_BORNE_N: Final = 5.0
"""Fall of the load at touchdown, in N: more than a measured load's error changes in a second."""
_BORNE_SHARE: Final = 0.5
"""Fall as a share of the weight. A tool that starts to sink accelerates by less than half of g, so it carries more."""
_HARDLY: Final = 0.25
_STALLED_S: Final = 0.15
"""Time, in seconds, for which a tool without measured loads must sink at less than a quarter of the commanded speed to
stand. An arm needs less time to begin to move."""
_SINKS_M_S: Final = 1e-3
_LEAVES_M: Final = 3e-3
_PERIOD_S: Final = 0.004
_GIVES_WAY_S: Final = 0.01
"""Time for which the arm halts at its measured position, in seconds: longer than a step of physics or controller."""
_NOISE_S: Final = 0.01
_USUAL_S: Final = 1.0
"""Time constants of the present load and of the usual one, which follows a lift and errors of the arm's model."""
_SPEED_S: Final = 0.03
"""Time constant of the measured speed."""
_UP: Final = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def carried_n(tool_jacobian: FloatArray, joint_loads_nm: FloatArray | None) -> float | None:
    """Force upwards, in N, that drives with these loads (n,) exert at the tool, by virtual work; None without loads.

    tool_jacobian (6, n), linear rows first.
    """
    if joint_loads_nm is None or not np.isfinite(joint_loads_nm).all():
        return None
    return float(joint_loads_nm @ joint_velocities(tool_jacobian, _UP, np.full(joint_loads_nm.size, np.inf)))


class Touchdown:
    """Touchdown state of one object, from grip to release."""

    def __init__(self) -> None:
        self.stands = False
        self._since_s = self._time_s = -math.inf
        self._height_m = self._sinks_m_s = self._stalled_s = 0.0
        self._carried_n = self._usual_n = 0.0

    def due(self, time_s: float) -> bool:
        """Return whether a load is due at `time_s`, every 4 ms: computing one takes a tenth of a tick."""
        return time_s - self._time_s >= _PERIOD_S

    @property
    def gives_way(self) -> bool:
        """Whether the object has just touched down"""
        return self.stands and self._time_s - self._since_s < _GIVES_WAY_S

    def update(self, carried_n: float | None, height_m: float, told_m_s: float, time_s: float) -> None:
        """Take the load, None where unknown, and the tool's height, as measured at `time_s`.

        told_m_s: commanded speed of the tool upwards until then.
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
            sinks = told_m_s > -_SINKS_M_S or self._sinks_m_s > -_HARDLY * told_m_s
            self._stalled_s = 0.0 if sinks else self._stalled_s + passed_s
        else:
            self._carried_n += (carried_n - self._carried_n) * -math.expm1(-passed_s / _NOISE_S)
            self._usual_n += (carried_n - self._usual_n) * -math.expm1(-passed_s / _USUAL_S)
        borne_n = self._usual_n - self._carried_n
        borne = borne_n > _BORNE_N + _BORNE_SHARE * max(0.0, self._usual_n)
        if told_m_s < -_SINKS_M_S and (borne or self._stalled_s > _STALLED_S):
            self.stands, self._since_s, self._stalled_s = True, time_s, 0.0
