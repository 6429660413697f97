"""Onset distances around the gripper, part of a StiffnessUpdate: an operator side traces where its sticks lead."""

from typing import Final

import msgspec
import numpy as np

from common.arrays import FloatArray

DIRECTIONS: Final = 4
"""Right, up, left and down of the tool"""
ACROSS: Final = 3
TURNED: Final = 2
PROBES: Final = 1 + DIRECTIONS * (ACROSS + TURNED)
"""Number of places for which distances are sent"""
LISTS: Final = 4
STEP_M: Final = 2.0**-9
AXES: Final = 1 + DIRECTIONS
"""The trigger, and sticks: across, right and up, and turning, right and up"""
MOST_JOINTS: Final = 32
CHANGE_STEP_S: Final = 2.0**-12
PERIOD_S: Final = 0.25
"""Period of looks from each probe while something moves, in seconds; the mean age of a look is half of it."""
_OF_A_JOINT: Final = 2 * AXES
_FREE: Final = 255
"""Code for a distance beyond the horizon."""
LONGEST_S: Final = 4.0
"""Longest T, in seconds: after 2 s of silence the robot side is disarmed, so that no longer T occurs."""


class Around(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Onset distances of full strength at probes: poses to which sticks may move the gripper before the arm stops.

    The first probe is the gripper's pose. Each direction adds five. Three are displaced by a fully deflected stick for
    a third, two thirds and all of `full_s`; two are turned by the other stick for half and all of it.
    """

    full_s: float
    """T: longest time until the arm stops, in seconds."""
    steps: bytes
    """(LISTS, PROBES) distances in steps of 2 mm, rounded towards the gripper: R2's, fast and slow, and L2's."""
    changes: bytes
    """(n, AXES) in 16 bits, steps of 0.25 ms: times that joints take to full travel of R2 and full stick deflection"""

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
    def of(cls, full_s: float, onsets_m: FloatArray, changes_s: FloatArray) -> "Around":
        """Pack distances (LISTS, PROBES), infinite beyond the horizon and clipped at 0.5 m.

        changes_s (n, AXES): see `changes`; clipped at 8 s.
        """
        steps = np.minimum(np.maximum(onsets_m / STEP_M, 0.0), _FREE - 1)
        steps[onsets_m == np.inf] = _FREE
        changes = np.minimum(np.maximum(np.rint(changes_s / CHANGE_STEP_S), -(2**15)), 2**15 - 1)
        return cls(full_s, steps.astype(np.uint8).tobytes(), changes.astype("<i2").tobytes())

    def onsets_m(self, horizon_m: float) -> FloatArray:
        """Return the distances (LISTS, PROBES) in metres, at most the horizon."""
        steps = np.frombuffer(self.steps, dtype=np.uint8).reshape(LISTS, PROBES)
        onsets_m: FloatArray = np.where(steps == _FREE, horizon_m, np.minimum(steps * STEP_M, horizon_m))
        return onsets_m

    def changes_s(self) -> FloatArray:
        """Return `changes` in seconds (n, AXES)."""
        changes: FloatArray = np.frombuffer(self.changes, dtype="<i2").reshape(-1, AXES) * np.float64(CHANGE_STEP_S)
        return changes

    def differs(self, other: "Around") -> bool:
        """Return whether T differs, or a distance by more than a step."""
        both = np.frombuffer(self.steps + other.steps, dtype=np.uint8).reshape(2, -1)
        return self.full_s != other.full_s or int((both.max(axis=0) - both.min(axis=0)).max()) > 1
