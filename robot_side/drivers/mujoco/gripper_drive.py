"""Drive of the gripper: a reference that opens and closes at a bounded speed and force, and detection of a grip."""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel

# Something stops the fingers if the drive lags its free position by more than this share of the stroke, and moves
# slower than this share of the stroke per second, for this time.
_BLOCKED_LAG = 0.02
_STANDING_SPEED_1_S = 0.05
_STANDING_TIME_S = 0.05
# Fingers that hold something may follow its slip. If they close faster than this share of their free speed, it is gone.
_LOST_SHARE = 0.5
# Time constant of the measured speed: stiff fingers chatter on a gripped object.
_SPEED_TIME_CONSTANT_S = 0.05
# Opening below which the fingers have closed on nothing.
_CLOSED_OPENING_M = 1e-3

GRIPPER: Final = np.dtype(
    [
        ("reference", np.float64),
        ("closure", np.float64),
        ("speed", np.float64),
        ("standing_s", np.float64),
        ("opening_m", np.float64),
        ("told_to_close", np.int64),
        ("open_length", np.float64),
        ("stroke", np.float64),
        ("stroke_time_s", np.float64),
        ("force_lead", np.float64),
        ("lag_s", np.float64),
    ]
)
"""Record of a gripper's drive. reference, closure: commanded and measured position, from 0 (open) to 1 (closed). speed:
averaged rate of the closure, in 1/s. standing_s: time for which something has stopped the fingers. For the other fields
see `GripperTravel`."""
GRIPPER_INPUT: Final = np.dtype([("place", np.int64), ("open", np.float64), ("closed", np.float64)])
"""Record of a gripper's actuator: its index in ctrl, and its inputs when the gripper is open and closed."""


class GripperDrive:
    """Reference of the gripper between 0 (open) and 1 (closed), and detection of a held object."""

    def __init__(self, travel: GripperTravel, stroke_time_s: float = 0.6) -> None:
        """Begin with an open gripper. stroke_time_s: time for the whole stroke at full speed.

        The default is that of a Robotiq 2F-85: 85 mm at 150 mm/s (its manual).
        """
        stroke = float(travel.lengths[-1] - travel.lengths[0])
        self.drive: np.ndarray = np.zeros(1, GRIPPER)
        """(1,) record of GRIPPER"""
        for name, value in (
            ("opening_m", travel.openings_m[0]),
            ("open_length", travel.lengths[0]),
            ("stroke", stroke),
            ("stroke_time_s", stroke_time_s),
            ("force_lead", travel.force_lead),
            ("lag_s", travel.lag_s),
        ):
            self.drive[name] = value
        self.samples: FloatArray = np.column_stack(
            [(travel.lengths - travel.lengths[0]) / stroke, travel.references, travel.openings_m]
        )
        """(k, 3) closure, reference and opening at samples along the travel"""
        self._travel = travel
        self._opening_m, self._standing_s = self.drive["opening_m"], self.drive["standing_s"]
        self._command = 0.0
        self._valid_until_s = -math.inf

    def inputs(self, places: IntArray) -> np.ndarray:
        """Return records (g,) of GRIPPER_INPUT for the actuators whose inputs are at `places` (g,), indices in ctrl."""
        inputs = np.zeros(places.shape, GRIPPER_INPUT)
        inputs["place"], inputs["open"], inputs["closed"] = (
            places,
            self._travel.open_control,
            self._travel.closed_control,
        )
        return inputs

    def command(self, closing: float, valid_until_s: float) -> None:
        """Close (`closing` = 1), open (-1) or hold (0) until `valid_until_s`; values between: shares of full speed.

        ValueError for a value outside [-1, 1] or a time that is not finite; nothing of such a command is applied.
        """
        if not -1.0 <= closing <= 1.0:
            raise ValueError(f"closing = {closing}; valid: from -1 (open) to +1 (close)")
        if not math.isfinite(valid_until_s):
            raise ValueError(f"valid_until_s = {valid_until_s}; valid: a finite time")
        self._command = closing
        self._valid_until_s = valid_until_s

    def commanded_at(self, time_s: float) -> float:
        """Return the command at `time_s`: share of full speed, +1 closes, 0 holds, -1 opens."""
        return self._command if time_s < self._valid_until_s else 0.0

    @property
    def opening_m(self) -> float:
        """Free gap between the fingers at the last measurement, in metres."""
        return float(self._opening_m[0])

    @property
    def holding(self) -> bool:
        """Whether an object between the fingers stopped them while they were commanded to close."""
        return bool(self._standing_s[0] >= _STANDING_TIME_S and self._opening_m[0] > _CLOSED_OPENING_M)


@inlined
def _at_closure(samples: Any, closure: float, column: int) -> Any:
    """Return a column of the samples (k, 3) at `closure`, by linear interpolation; constant beyond the ends."""
    if not closure > samples[0, 0]:
        return samples[0, column]
    for k in range(1, samples.shape[0]):
        if closure < samples[k, 0]:
            slope = (samples[k, column] - samples[k - 1, column]) / (samples[k, 0] - samples[k - 1, 0])
            return slope * (closure - samples[k - 1, 0]) + samples[k - 1, column]
    return samples[samples.shape[0] - 1, column]


@building_block
def advance_gripper(
    gripper: Any, samples: FloatArray, moving: float, step_s: float, length: float, length_speed: float
) -> None:
    """Advance one gripper's reference by `step_s`, from the drive's measured length and the speed of this length.

    moving: command from `GripperDrive.commanded_at`.
    """
    gripper.closure = (length - gripper.open_length) / gripper.stroke
    gripper.opening_m = _at_closure(samples, gripper.closure, 2)
    gripper.speed += (length_speed / gripper.stroke - gripper.speed) * min(step_s / _SPEED_TIME_CONSTANT_S, 1.0)
    free = _at_closure(samples, gripper.closure, 1)
    if moving != 0.0:
        gripper.told_to_close = 1 if moving > 0.0 else 0
        moved = gripper.reference + moving * step_s / gripper.stroke_time_s
        # The servo's damping lets a moving drive lag its reference without any force on the fingers. The reference
        # may lead only in the commanded direction, so that a grip is released at once.
        center = free + gripper.lag_s * gripper.speed
        lead = math.copysign(gripper.force_lead, moving)
        moved = min(max(moved, center + min(lead, 0.0)), center + max(lead, 0.0))
        gripper.reference = min(max(moved, 0.0), 1.0)

    blocked = gripper.reference - free > min(_BLOCKED_LAG, 0.5 * gripper.force_lead)
    holds = gripper.standing_s >= _STANDING_TIME_S
    follows = holds and gripper.speed * gripper.stroke_time_s < _LOST_SHARE
    standing = abs(gripper.speed) < _STANDING_SPEED_1_S or follows
    stopped = blocked and standing and gripper.told_to_close == 1
    gripper.standing_s = gripper.standing_s + step_s if stopped else 0.0
