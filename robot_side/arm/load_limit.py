"""Limit of the joints' loads, at which the arm stops: a servo that stalls, or pushes on something."""

from collections.abc import Sequence

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState

_FURTHER = 1.1
"""Share of the load when the arm was armed, above which it stops again: else it could not be driven out of a press"""
_STATES = 2
"""Number of states in a row, as one may be noise"""


class LoadLimit:
    """Judge of the joints' loads."""

    def __init__(self, limits: JointLimits, names: Sequence[str]) -> None:
        """names (n,): the joints'."""
        self._limits, self._names = limits, names
        self._before: FloatArray | None = None
        self._since_s, self._beyond = -np.inf, 0

    def over(self, state: ArmState, *, armed: bool) -> str | None:
        """Take the newest state; return why an armed arm must stop, in words, or None.

        An arm without measured loads or limits is never stopped.
        """
        if state.joint_loads_nm is None or not np.isfinite(self._limits.load_nm).any():
            return None
        loads_nm = np.abs(state.joint_loads_nm)
        if not armed or self._before is None:
            self._before, self._beyond = loads_nm, 0
            return None
        self._before = np.minimum(self._before, loads_nm)
        beyond = loads_nm - np.maximum(self._limits.load_nm, _FURTHER * self._before)
        worst = int(beyond.argmax())
        if state.time_s > self._since_s:
            self._since_s, self._beyond = state.time_s, self._beyond + 1 if beyond[worst] > 0.0 else 0
        if self._beyond < _STATES:
            return None
        limit_nm = self._limits.load_nm[worst]
        return f"{self._names[worst]} bears {loads_nm[worst]:.1f} N m; its limit is {limit_nm:.1f} N m"
