"""Map of onset distances around the gripper, part of a StiffnessUpdate; the operator side traces its sticks in it."""

from typing import Final

import msgspec
import numpy as np

from common.arrays import FloatArray

DIRECTIONS: Final = 4
"""Number of directions in which a stick moves or turns the tool: right, up, left and down"""
ACROSS: Final = 3
TURNED: Final = 2
PROBES: Final = 1 + DIRECTIONS * (ACROSS + TURNED)
"""Number of poses (probes) for which distances are sent"""
LISTS: Final = 4
STEP_M: Final = 2.0**-9
AXES: Final = 1 + DIRECTIONS
"""Number of columns of `changes`: R2, left stick right and up (across), right stick right and up (turning)"""
MOST_JOINTS: Final = 32
CHANGE_STEP_S: Final = 2.0**-12
PERIOD_S: Final = 0.25
"""Period, in seconds, of computing each probe's distances while something moves; their mean age is half a period."""
_OF_A_JOINT: Final = 2 * AXES
_FREE: Final = 255
"""Code in `steps` for a distance beyond the horizon."""
LONGEST_S: Final = 4.0
"""Largest valid `full_s` (T), in seconds; none is longer, as the robot side is disarmed after 2 s of silence."""


class Around(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Onset distances of full strength at probes: poses to which sticks may move the gripper before the arm stops.

    The first probe is the gripper's pose. Each direction adds five probes. Three are displaced by the left stick,
    fully deflected for a third, two thirds and all of `full_s`. Two are turned by the right stick, fully deflected for
    half and all of `full_s`.
    """

    full_s: float
    """T: longest time until the arm stops, in seconds."""
    steps: bytes
    """(LISTS, PROBES) distances, a byte each, in steps of 2 mm, rounded towards the gripper. The lists are R2 fast,
    R2 slow, L2 fast and L2 slow."""
    changes: bytes
    """(n, AXES) times that each of the n joints takes from rest to full travel of R2 or to a full stick deflection, in
    signed 16-bit steps of 0.25 ms"""

    def __post_init__(self) -> None:
        if not (0.0 < self.full_s <= LONGEST_S):
            raise ValueError(f"full_s = {self.full_s}; valid: above 0 to {LONGEST_S}")
        if len(self.steps) != LISTS * PROBES:
            raise ValueError(f"steps has {len(self.steps)} bytes; valid: {LISTS * PROBES} bytes")
        if not self.changes or len(self.changes) % _OF_A_JOINT or len(self.changes) > MOST_JOINTS * _OF_A_JOINT:
            raise ValueError(
                f"changes has {len(self.changes)} bytes; valid: {_OF_A_JOINT} for each of 1 to {MOST_JOINTS} joints"
            )

    @classmethod
    def of(cls, full_s: float, onsets_m: FloatArray, changes_s: FloatArray) -> "Around":
        """Pack onset distances and change times.

        onsets_m (LISTS, PROBES): infinite beyond the horizon; finite distances are clipped at 0.5 m. changes_s
        (n, AXES): `changes` in seconds, clipped at ± 8 s.
        """
        steps = np.minimum(np.maximum(onsets_m / STEP_M, 0.0), _FREE - 1)
        steps[onsets_m == np.inf] = _FREE
        changes = np.minimum(np.maximum(np.rint(changes_s / CHANGE_STEP_S), -(2**15)), 2**15 - 1)
        return cls(full_s, steps.astype(np.uint8).tobytes(), changes.astype("<i2").tobytes())

    def onsets_m(self, horizon_m: float) -> FloatArray:
        """Return the onset distances (LISTS, PROBES) in metres, at most `horizon_m`."""
        steps = np.frombuffer(self.steps, dtype=np.uint8).reshape(LISTS, PROBES)
        onsets_m: FloatArray = np.where(steps == _FREE, horizon_m, np.minimum(steps * STEP_M, horizon_m))
        return onsets_m

    def changes_s(self) -> FloatArray:
        """Return `changes` in seconds (n, AXES)."""
        changes: FloatArray = np.frombuffer(self.changes, dtype="<i2").reshape(-1, AXES) * np.float64(CHANGE_STEP_S)
        return changes

    def differs(self, other: "Around") -> bool:
        """Return whether `full_s` differs at all, or any distance by more than one step."""
        pairs = zip(self.steps, other.steps, strict=True)
        return self.full_s != other.full_s or any(not -1 <= one - two <= 1 for one, two in pairs)
