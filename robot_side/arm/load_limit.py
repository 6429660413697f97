"""Limit of the joints' loads, at which the arm stops: a servo that stalls, or pushes on something."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState

_FURTHER = 1.1
"""Share of the load when the arm was armed, above which it stops again: else it could not be driven out of a press"""
_STATES, _OF = 2, 3
"""Number of states beyond the limit, of so many, as one may be noise"""


class LoadLimit:
    """Judge of the joints' loads."""

    def __init__(self, limits: JointLimits, names: Sequence[str]) -> None:
        """names (n,): the joints'."""
        self._limits, self._names = limits, names
        self._before: FloatArray | None = None
        self._since_s, self._beyond = -np.inf, deque[bool](maxlen=_OF)

    def over(self, state: ArmState, *, armed: bool) -> str | None:
        """Take the newest state; return why an armed arm must stop, in words, or None.

        An arm without limits is never stopped; one with limits is, when its loads are missing.
        """
        if not np.isfinite(self._limits.load_nm).any():
            return None
        if state.joint_loads_nm is None:
            return "load_nm is set, and the driver sends no joint_loads" if armed else None
        loads_nm = np.abs(state.joint_loads_nm)
        if not armed or self._before is None:
            self._before = loads_nm
            self._beyond.clear()
            return None
        self._before = np.minimum(self._before, loads_nm)
        beyond = loads_nm - np.maximum(self._limits.load_nm, _FURTHER * self._before)
        worst = int(beyond.argmax())
        if state.time_s > self._since_s:
            self._since_s = state.time_s
            self._beyond.append(bool(beyond[worst] > 0.0))
        if sum(self._beyond) < _STATES:
            return None
        limit_nm = self._limits.load_nm[worst]
        return f"{self._names[worst]} bears {loads_nm[worst]:.1f} N m; its limit is {limit_nm:.1f} N m"
