"""Drive of the gripper: a reference that opens and closes at a bounded speed and force, and detection of a grip."""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.drivers.mujoco.gripper_measurement import (
    LEAD,
    STANDING_SPEED_1_S,
    STANDING_TIME_S,
    GripperTravel,
)
from robot_side.drivers.mujoco.hand.gripper_sweep import SPEED_TIME_CONSTANT_S, STROKE_TIME_S

# Fingers that hold something may follow its slip. If they close faster than this share of their free speed, it is gone.
_LOST_SHARE = 0.5

GRIPPER: Final = np.dtype(
    [
        ("reference", np.float64),
        ("closure", np.float64),
        ("speed", np.float64),
        ("standing_s", np.float64),
        ("opening_m", np.float64),
        ("told_to_close", np.int64),
        ("least", np.float64),
        ("most", np.float64),
        ("stroke_time_s", np.float64),
        ("servo_lag_s", np.float64),
        ("lag_s", np.float64),
        ("force_lead", np.float64),
        ("opening_force_lead", np.float64),
    ]
)
"""Record of a gripper's drive. reference, closure: commanded and measured position, from 0 (open) to 1 (closed); the
reference goes beyond, from `least` to `most`, to press. speed: averaged rate of the closure, in 1/s. standing_s: time
for which something has stopped the fingers. servo_lag_s, lag_s and the leads: see `GripperTravel`."""
GRIPPER_INPUT: Final = np.dtype(
    [
        ("place", np.int64),
        ("actuator", np.int64),
        ("open", np.float64),
        ("closed", np.float64),
        ("open_length", np.float64),
        ("per_length", np.float64),
    ]
)
"""Record of a gripper's actuator: its index in ctrl and among the actuators, its inputs when the gripper is open and
closed, its length when open, and the weight of its length in the closure."""


class GripperDrive:
    """Reference of the gripper between 0 (open) and 1 (closed), and detection of a held object."""

    def __init__(self, travel: GripperTravel, stroke_time_s: float = STROKE_TIME_S) -> None:
        """Begin with an open gripper. stroke_time_s: time for the whole stroke at full speed."""
        self.drive: np.ndarray = np.zeros(1, GRIPPER)
        """(1,) record of GRIPPER"""
        for name, value in (
            ("opening_m", travel.openings_m[0]),
            ("least", travel.ends[0]),
            ("most", travel.ends[1]),
            ("stroke_time_s", stroke_time_s),
            ("servo_lag_s", travel.lags_s[0]),
            ("lag_s", travel.lags_s[1]),
            ("force_lead", travel.force_lead),
            ("opening_force_lead", travel.opening_force_lead),
        ):
            self.drive[name] = value
        self.samples: FloatArray = np.column_stack(
            [travel.closures, travel.references, travel.openings_m, travel.resists]
        )
        """(k, 4) closure, reference, opening, and lead that the gripper itself resists, along the travel"""
        self._travel, self._closed_from = travel, travel.closed_from
        self._opening_m, self._standing_s = self.drive["opening_m"], self.drive["standing_s"]
        self._command = 0.0
        self._valid_until_s = -math.inf

    def inputs(self, places: IntArray, actuators: IntArray) -> np.ndarray:
        """Return records (g,) of GRIPPER_INPUT for the `actuators` (g,) with inputs at `places` (g,) in ctrl."""
        inputs, travel = np.zeros(places.shape, GRIPPER_INPUT), self._travel
        for name, values in (
            ("place", places),
            ("actuator", actuators),
            ("open", travel.open_control),
            ("closed", travel.closed_control),
            ("open_length", travel.open_lengths),
            ("per_length", travel.per_length),
        ):
            inputs[name] = values
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
        """Whether an object between the fingers stopped them while they were commanded to close.

        Never where they stop by themselves: at the gap of the closed gripper, or where it hinders itself.
        """
        return bool(self._standing_s[0] >= STANDING_TIME_S and self.drive["closure"][0] < self._closed_from)


@inlined
def _at_closure(samples: Any, closure: float, column: int) -> Any:
    """Return a column of the samples (k, 4) at `closure`, by linear interpolation; constant beyond the ends."""
    if not closure > samples[0, 0]:
        return samples[0, column]
    for k in range(1, samples.shape[0]):
        if closure < samples[k, 0]:
            slope = (samples[k, column] - samples[k - 1, column]) / (samples[k, 0] - samples[k - 1, 0])
            return slope * (closure - samples[k - 1, 0]) + samples[k - 1, column]
    return samples[samples.shape[0] - 1, column]


@building_block
def advance_gripper(
    gripper: Any, samples: FloatArray, moving: float, step_s: float, closure: float, closure_speed: float
) -> None:
    """Advance one gripper's reference by `step_s`, from the measured `closure` and its speed in 1/s.

    moving: command from `GripperDrive.commanded_at`.
    """
    gripper.closure = closure
    gripper.opening_m = _at_closure(samples, closure, 2)
    gripper.speed += (closure_speed - gripper.speed) * min(step_s / SPEED_TIME_CONSTANT_S, 1.0)
    free = _at_closure(samples, closure, 1)
    if moving != 0.0:
        gripper.told_to_close = 1 if moving > 0.0 else 0
        moved = gripper.reference + moving * step_s / gripper.stroke_time_s
        # A moving drive lags its reference without any force on the fingers; a lead beyond the largest force is no use.
        speed = max(math.copysign(1.0, moving) * gripper.speed, 0.0)
        strongest = gripper.force_lead if moving > 0.0 else gripper.opening_force_lead
        lead = min(gripper.lag_s * speed + LEAD, gripper.servo_lag_s * speed + strongest)
        # The reference may lead only in the commanded direction, so that a grip is released at once.
        moved = min(max(moved, free), free + lead) if moving > 0.0 else max(min(moved, free), free - lead)
        gripper.reference = min(max(moved, gripper.least), gripper.most)

    resisted = gripper.reference - free - gripper.lag_s * gripper.speed > _at_closure(samples, closure, 3)
    follows = gripper.standing_s >= STANDING_TIME_S and gripper.speed * gripper.stroke_time_s < _LOST_SHARE
    standing = abs(gripper.speed) < STANDING_SPEED_1_S or follows
    stopped = resisted and standing and gripper.told_to_close == 1
    gripper.standing_s = gripper.standing_s + step_s if stopped else 0.0
