"""What is held comes to stand on something: noticed by what the arm no longer carries.

    carried ─▶ stands ─▶ carried
            │         └ the tool has risen by 3 mm, or nothing is held any more
            └ the tool is told to sink, and something bears more than 5 N and half of what it carried

Its motion downwards ends there, and what the drives have wound up by then is let go.
"""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.resolved_rate import joint_velocities

_BORNE_N: Final = 5.0
"""Above what a joint's torque is wrong by within a second."""
_BORNE_SHARE: Final = 0.5
"""Of what is carried: arms that begin to sink do it with less than half of gravity's acceleration."""
_HARDLY: Final = 0.25
_STALLED_S: Final = 0.15
"""Without known loads: for so long the tool has hardly sunk, a quarter of what it was told. Arms take less to begin."""
_SINKS_M_S: Final = 1e-3
_LEAVES_M: Final = 3e-3
_GIVES_WAY_S: Final = 0.01
"""So long the arm is told to halt where it is measured: in simulations a step of the physics lies in it."""
_NOISE_S: Final = 0.01
_USUAL_S: Final = 1.0
"""Time constants of what is carried now, and usually: the latter follows a lift, and a model that is a little wrong."""
_SPEED_S: Final = 0.03
"""And of the speed."""
_UP: Final = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def carried_n(tool_jacobian: FloatArray, joint_loads_nm: FloatArray | None) -> float | None:
    """The force upwards that drives with these loads (n,) give at the tool: the work that a rise by one metre takes.

    tool_jacobian (6, n), linear rows first. None where the loads are not known.
    """
    if joint_loads_nm is None:
        return None
    return float(joint_loads_nm @ joint_velocities(tool_jacobian, _UP, np.full(joint_loads_nm.size, np.inf)))


class TouchingDown:
    """One thing from when it is gripped until it is let go."""

    def __init__(self) -> None:
        self.stands = False
        self._since_s = self._time_s = -math.inf
        self._height_m = self._sinks_m_s = self._stalled_s = 0.0
        self._carried_n = self._usual_n = 0.0

    @property
    def gives_way(self) -> bool:
        """Whether it has just come to stand."""
        return self.stands and self._time_s - self._since_s < _GIVES_WAY_S

    def update(self, carried_n: float | None, height_m: float, told_m_s: float, time_s: float) -> None:
        """Take in what was measured at `time_s`: what the arm carries, None where unknown, and the tool's height.

        told_m_s: the speed upwards that it was told until now.
        """
        passed_s, sunk_m = time_s - self._time_s, self._height_m - height_m
        if passed_s <= 0.0:
            return
        first, self._time_s = passed_s == math.inf, time_s
        if self.stands:
            self._height_m = min(self._height_m, height_m)
            self.stands = height_m - self._height_m < _LEAVES_M
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
