import math
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.compiled.kernel import NUMBER, compiled, input_array, record_array
from robot_side.simulation.gripper_drive import GRIPPER, GripperDrive, advance_gripper
from robot_side.simulation.gripper_travel import (
    GripperSample,
    GripperServo,
    GripperTravel,
    candidate_ends,
    jaw_pairs,
    jaw_stroke_m,
    travel_from_samples,
)

STEP_S = 0.001
SERVO = GripperServo(
    gain=np.array([2.0]), stiffness=np.array([10.0]), damping=np.array([0.5]), force_limit=np.array([5.0])
)


def samples(openings_m: FloatArray, lengths: FloatArray, controls: FloatArray) -> list[GripperSample]:
    """Two jaws with a constant other pair; one finger joint."""
    return [
        GripperSample(np.array([control]), np.array([length]), length, np.array([opening, opening + 0.02, 0.01]))
        for opening, length, control in zip(openings_m, lengths, controls, strict=True)
    ]


def travel(force_lead: float = 0.1) -> GripperTravel:
    grid = np.linspace(0.0, 1.0, 5)
    return GripperTravel(
        open_control=np.array([255.0]),
        closed_control=np.array([0.0]),
        open_fingers=np.array([0.04]),
        references=grid,
        lengths=0.04 * (1.0 - grid),
        openings_m=0.08 * (1.0 - grid),
        force_lead=force_lead,
        lag_s=0.0,
    )


@compiled(record_array(GRIPPER), input_array(2), NUMBER, NUMBER, NUMBER, NUMBER)
def _advance(
    grippers: Any, samples: FloatArray, moving: float, step_s: float, length: float, length_speed: float
) -> None:
    advance_gripper(grippers[0], samples, moving, step_s, length, length_speed)


def advance(drive: GripperDrive, time_s: float, step_s: float, length: float, length_speed: float) -> None:
    """Move the reference on by `step_s` from `time_s`."""
    _advance(drive.drive, drive.samples, drive.moving(time_s), step_s, length, length_speed)


class Rig:
    """A drive whose fingers follow it at once, unless something `thickness_m` wide is between them."""

    def __init__(self, thickness_m: float = 0.0) -> None:
        self.drive = GripperDrive(travel(), stroke_time_s=0.5)
        self.thickness_m = thickness_m
        self.length = 0.04
        self.step = 0

    def run(self, steps: int) -> "Rig":
        for _ in range(steps):
            advance(self.drive, self.step * STEP_S, STEP_S, self.length, self._speed())
            self.length = self._next()
            self.step += 1
        return self

    def _next(self) -> float:
        return max(0.04 * float(self.drive.control[0]) / 255.0, self.thickness_m / 2.0)

    def _speed(self) -> float:
        return (self._next() - self.length) / STEP_S


def test_it_feels_what_it_holds_and_what_it_does_not() -> None:
    holding, empty = Rig(thickness_m=0.03), Rig()
    for rig in (holding, empty):
        rig.drive.command(1.0, 10.0)
        rig.run(200)
        assert not rig.drive.holding  # still moving
        rig.run(800)
    assert holding.drive.holding
    assert holding.drive.opening_m == pytest.approx(0.03)
    assert not empty.drive.holding
    assert empty.drive.opening_m == 0.0
    holding.drive.command(0.0, 10.0)
    assert holding.run(100).drive.holding


@pytest.mark.parametrize("bad", [1.1, -1.1, math.nan, math.inf])
def test_bad_commands_are_named_and_not_applied(bad: float) -> None:
    rig = Rig()
    with pytest.raises(ValueError, match="closing"):
        rig.drive.command(bad, 10.0)
    with pytest.raises(ValueError, match="valid_until_s"):
        rig.drive.command(1.0, math.nan)
    np.testing.assert_array_equal(rig.run(10).drive.control, [255.0])


@pytest.mark.parametrize("low_is_open", [True, False])
def test_the_wider_end_is_the_open_one(low_is_open: bool) -> None:
    openings = np.array([0.08, 0.05, 0.03, 0.0])
    lengths, controls = np.array([0.0, 0.3, 0.5, 0.8]), np.array([0.0, 1.0, 2.0, 3.0])
    measured = samples(openings, lengths, controls) if low_is_open else samples(openings[::-1], lengths, controls)
    found = travel_from_samples(measured, SERVO)
    assert found is not None
    np.testing.assert_array_equal(found.open_control, [0.0] if low_is_open else [3.0])
    np.testing.assert_array_equal(found.closed_control, [3.0] if low_is_open else [0.0])
    np.testing.assert_allclose(found.openings_m, openings)
    assert found.force_lead == pytest.approx(min(0.3, 5.0 / (2.0 * 3.0)))
    assert found.lag_s == pytest.approx(0.05)


def test_fingers_that_meet_before_the_inputs_end_keep_a_monotone_travel() -> None:
    measured = samples(np.array([0.08, 0.04, 0.0, 0.0]), np.array([0.0, 0.4, 0.8, 0.8]), np.array([0.0, 1.0, 2.0, 3.0]))
    found = travel_from_samples(measured, SERVO)
    assert found is not None
    np.testing.assert_allclose(found.references, [0.0, 1.0 / 3.0, 2.0 / 3.0])
    np.testing.assert_allclose(found.openings_m, [0.08, 0.04, 0.0])


def test_a_gripper_whose_gaps_do_not_change_is_none() -> None:
    still = samples(np.full(4, 0.05), np.linspace(0.0, 1.0, 4), np.linspace(0.0, 1.0, 4))
    assert jaw_stroke_m(still) == 0.0
    assert travel_from_samples(still, SERVO) is None
    with pytest.raises(ValueError, match="samples"):
        travel_from_samples(still[:1], SERVO)


def test_two_actuators_may_run_against_each_other() -> None:
    lower, upper = np.array([0.0, -1.0]), np.array([1.0, 0.0])
    ends = [(first.tolist(), last.tolist()) for first, last in candidate_ends(lower, upper)]
    assert ends == [([0.0, -1.0], [1.0, 0.0]), ([0.0, 0.0], [1.0, -1.0])]
    assert len(candidate_ends(np.zeros(1), np.ones(1))) == 1
    assert len(candidate_ends(np.zeros(4), np.ones(4))) == 1


def test_pairs_have_a_finger_and_two_bodies() -> None:
    pairs = jaw_pairs(np.array([7, 8, 9, 10]), np.array([1, 2, 2, 3]), np.array([False, True, True, False]))
    assert pairs == [(8, 7), (9, 7), (10, 8), (10, 9)]


def test_a_travel_that_turns_back_is_refused() -> None:
    with pytest.raises(ValueError, match="monotone"):
        GripperTravel(**{**travel().__dict__, "lengths": np.array([0.0, 1.0, 0.5, 2.0, 3.0])})
