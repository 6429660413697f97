"""When the swept law makes looks, tick by tick in virtual time, and which onset distances are valid in between."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.laws.prospect import FIELD_PERIOD_S
from robot_side.laws.recent_looks import STEADY_S
from robot_side.tick.sensed import L2, R2, STICK
from tests.helpers.field.fields import EQUAL_M, ball_pose
from tests.helpers.field.situations import Senses, at, situation, swept, walls
from tests.helpers.gripper_poses import free_pose

# Times of looks


class Watched:
    """A law that is used tick by tick, with a record of the looks in each tick."""

    def __init__(self) -> None:
        self.law = swept()
        self.looks: list[tuple[float, str]] = []
        self.now_s = 7.0

    def tick(self, step_s: float, count: int, **changes: Any) -> list[int]:
        """Run `count` ticks, `step_s` apart; return the number of looks in each."""
        numbers = []
        for _ in range(count):
            self.now_s += step_s
            before = self.law.summary()["fields"]
            self.law.sense(situation(ball_pose(), walls(0.1), **changes), self.now_s)
            numbers.append(self.law.summary()["fields"] - before)
            looked = np.argwhere(self.law.memory.looked_s == self.now_s)[:, 0].tolist()
            self.looks += [(self.now_s, {R2: "r2", L2: "l2", STICK: "stick"}[side]) for side in looked]
            assert len(looked) == numbers[-1]
        return numbers

    def pauses_s(self, side: str) -> FloatArray:
        times = [when_s for when_s, where in self.looks if where == side]
        return np.diff(times)


@pytest.fixture
def watched() -> Watched:
    return Watched()


@pytest.mark.parametrize("lateral", [(0.0, 0.0), (0.5, 0.2)])
def test_fields_are_looked_at_in_turns_a_hundred_times_a_second(watched: Watched, lateral: tuple[float, float]) -> None:
    numbers = watched.tick(0.001, 200, lateral=lateral)
    sides = ["r2", "l2"] + ["stick"] * (lateral != (0.0, 0.0))
    # The triggers must never be without a field.
    assert numbers[0] == len(sides)
    assert max(numbers[1:]) == 1
    for side in sides:
        pauses_s = watched.pauses_s(side)
        assert len(pauses_s) >= 18
        # The first pause is longer by the tick that measures the motion, and by one tick for each side before this one.
        assert pauses_s[0] <= FIELD_PERIOD_S + 0.003 + 1e-9
        np.testing.assert_allclose(pauses_s[1:], FIELD_PERIOD_S, atol=1e-9)


@pytest.mark.parametrize("step_s", [0.004, 0.005, 0.012, 0.05])
def test_no_side_starves_however_late_the_ticks_are(watched: Watched, step_s: float) -> None:
    watched.tick(step_s, 60, lateral=(1.0, 0.0))
    for side in ("r2", "l2", "stick"):
        assert watched.pauses_s(side).max() <= max(3.0 * FIELD_PERIOD_S, step_s) + step_s + 1e-9


def test_a_tick_has_two_looks_where_one_has_waited_too_long_and_all_after_a_long_pause(watched: Watched) -> None:
    assert watched.tick(0.004, 1, lateral=(1.0, 0.0)) == [3]
    assert set(watched.tick(0.004, 60, lateral=(1.0, 0.0))) == {0, 1, 2}
    assert watched.tick(0.06, 1, lateral=(1.0, 0.0)) == [3]


def test_a_stick_that_is_deflected_is_looked_along_within_a_tick_or_two(watched: Watched) -> None:
    watched.tick(0.001, 25)
    assert "stick" not in {side for _, side in watched.looks}
    watched.tick(0.001, 3, lateral=(0.3, 0.0))
    assert "stick" in {side for _, side in watched.looks}
    before = len([1 for _, side in watched.looks if side == "stick"])
    watched.tick(0.001, 30)
    assert len([1 for _, side in watched.looks if side == "stick"]) == before


def test_what_an_object_is_is_worked_out_when_roles_or_the_held_object_change() -> None:
    law, ticked = swept(), situation(ball_pose(), walls(0.1, 0.1))
    law.sense(ticked, 0.0)
    first = law.asked(R2, ticked).classes
    law.sense(situation(ball_pose(), walls(0.2, 0.1)), 0.001)
    assert law.asked(R2, situation(ball_pose(), walls(0.2, 0.1))).classes is first
    held = law.asked(R2, situation(ball_pose(), walls(0.2, 0.1), held=1)).classes
    assert held.tolist() != first.tolist()


# Validity between two looks


def test_a_way_that_was_found_holds_for_a_tenth_of_a_second_and_a_new_one_at_once() -> None:
    """Strength rises at once and falls slowly, so that noise causes no flicker where an object is just passed."""
    senses = Senses(step_s=0.01)
    near, far = walls(0.05), walls(0.09)
    there = senses.sense(at(0.0), near).r2.fast_m
    for tick in range(1, 30):
        found = senses.sense(at(0.0), far).r2.fast_m
        if tick * 0.01 < STEADY_S - 1e-6:
            np.testing.assert_allclose(found, there, atol=1e-12)
        elif tick * 0.01 > STEADY_S + 0.01:
            np.testing.assert_allclose(found, np.array(there) + 0.04, atol=EQUAL_M)
    for _ in range(2):
        again = senses.sense(at(0.0), near).r2.fast_m
    np.testing.assert_allclose(again, there, atol=1e-12)


# Mismatches


def test_a_gripper_of_more_spheres_that_is_refused_leaves_the_fingers_at_rest() -> None:
    law, objects = swept(), walls(0.1)
    few, many = (free_pose([[0.01 * k, 0.0, 0.0] for k in range(count)], [0.008] * count) for count in (6, 9))
    expected = law.sense(situation(few, objects), 1.0)
    with pytest.raises(ValueError, match="tool_position_m"):
        law.sense(situation(replace(many, tool_position_m=np.full(3, np.nan)), objects), 1.001)
    for tick in range(2, 40):
        found = law.sense(situation(few, objects), 1.0 + 0.001 * tick)
    assert law.memory.state["moves_fingers"][0] == 0
    np.testing.assert_allclose(found.r2.fast_m, expected.r2.fast_m, atol=EQUAL_M)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"joint_velocities_rad_s": np.zeros(7)}, "joint_velocities_rad_s = 7; valid: 6"),
        ({"lateral": (np.nan, 0.0)}, "lateral"),
        ({"pose": replace(ball_pose(), sphere_centers_m=np.zeros((4, 3)))}, "pose.sphere_centers_m = 4; valid: 1"),
        ({"pose": replace(ball_pose(), tool_jacobian=np.zeros((6, 5)))}, "columns = 5; valid: 6"),
    ],
)
def test_what_does_not_fit_is_named(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        swept().sense(replace(situation(ball_pose(), walls(0.1)), **changes), 1.0)


def test_without_spheres_nothing_is_ahead() -> None:
    sensed = swept().sense(situation(free_pose(np.zeros((0, 3)), np.zeros(0)), walls(0.1)), 1.0)
    assert sensed.r2.fast_m == (sensed.horizon_m,) * 8
