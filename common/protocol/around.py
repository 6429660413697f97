"""Ways from around the gripper, part of a StiffnessUpdate: for an operator side that traces where its sticks lead."""

from typing import Final

import msgspec
import numpy as np

from common.arrays import FloatArray

DIRECTIONS: Final = 4
"""Right, up, left and down of the tool"""
ACROSS: Final = 3
TURNED: Final = 2
PROBES: Final = 1 + DIRECTIONS * (ACROSS + TURNED)
"""Number of places from which a way is sent"""
LISTS: Final = 4
STEP_M: Final = 2.0**-9
AXES: Final = 1 + DIRECTIONS
"""The trigger, and sticks: across, right and up, and turning, right and up"""
MOST_JOINTS: Final = 32
CHANGE_STEP_S: Final = 2.0**-12
PERIOD_S: Final = 0.25
"""The period of looks from each probe while something moves; on average a look is half as old."""
_OF_A_JOINT: Final = 2 * AXES
_FREE: Final = 255
"""Stands for a way that nothing ends within the horizon."""
LONGEST_S: Final = 4.0
"""A robot side that has not heard of its operator for 2 s is disarmed: there is no map for a longer T."""


class Around(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Ways of full strength from probes: places to which sticks may take the gripper until the arm stands.

    The first probe is where the gripper is. Then, for each direction, three lie across: where a fully deflected stick
    leads in a third, two thirds and all of `full_s`. Two are turned there for half and all of it.
    """

    full_s: float
    """T: until the arm stands at the latest."""
    steps: bytes
    """(LISTS, PROBES) ways in steps of 2 mm, rounded towards the gripper: R2's, fast and slow, and L2's."""
    changes: bytes
    """(n, AXES) in 16 bits, steps of 0.25 ms: how long joints take to full travel of R2 and fully deflected sticks"""

    def __post_init__(self) -> None:
        if not (0.0 < self.full_s <= LONGEST_S):
            raise ValueError(f"full_s = {self.full_s}; valid: above 0 to {LONGEST_S}")
        if len(self.steps) != LISTS * PROBES:
            raise ValueError(f"steps has {len(self.steps)} bytes; valid: {LISTS * PROBES}")
        if not self.changes or len(self.changes) % _OF_A_JOINT or len(self.changes) > MOST_JOINTS * _OF_A_JOINT:
            raise ValueError(
                f"changes has {len(self.changes)} bytes; valid: {_OF_A_JOINT} for each of 1 to {MOST_JOINTS} joints"
            )

    @classmethod
    def of(cls, full_s: float, ways_m: FloatArray, changes_s: FloatArray) -> "Around":
        """Make one of ways (LISTS, PROBES), infinite where nothing ends them; 0.5 m stands for longer ones.

        changes_s (n, AXES): see `changes`; 8 s stand for longer.
        """
        steps = np.minimum(np.maximum(ways_m / STEP_M, 0.0), _FREE - 1)
        steps[ways_m == np.inf] = _FREE
        changes = np.minimum(np.maximum(np.rint(changes_s / CHANGE_STEP_S), -(2**15)), 2**15 - 1)
        return cls(full_s, steps.astype(np.uint8).tobytes(), changes.astype("<i2").tobytes())

    def ways_m(self, horizon_m: float) -> FloatArray:
        """Work out the ways (LISTS, PROBES), none beyond the horizon."""
        steps = np.frombuffer(self.steps, dtype=np.uint8).reshape(LISTS, PROBES)
        ways_m: FloatArray = np.where(steps == _FREE, horizon_m, np.minimum(steps * STEP_M, horizon_m))
        return ways_m

    def changes_s(self) -> FloatArray:
        """Work out `changes` in seconds (n, AXES)."""
        changes: FloatArray = np.frombuffer(self.changes, dtype="<i2").reshape(-1, AXES) * np.float64(CHANGE_STEP_S)
        return changes

    def differs(self, other: "Around") -> bool:
        """Tell whether a way differs by more than a step, or T does."""
        both = np.frombuffer(self.steps + other.steps, dtype=np.uint8).reshape(2, -1)
        return self.full_s != other.full_s or int((both.max(axis=0) - both.min(axis=0)).max()) > 1
