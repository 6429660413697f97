"""When the swept law makes looks, tick by tick in virtual time, and which onset distances are valid in between."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robot_side.laws.recent_looks import STEADY_S
from robot_side.tick.sensed import R2
from tests.helpers.field.fields import EQUAL_M, ball_pose
from tests.helpers.field.situations import Senses, at, moving, situation, swept, walls
from tests.helpers.gripper_poses import free_pose

# Times of looks

SLOWLY, FORTH = moving(np.array([0.0, 0.0, 0.005])), moving(np.array([0.0, 0.0, 0.2]))


class Watched:
    """A law that is used tick by tick."""

    def __init__(self) -> None:
        self.law, self.now_s, self.objects = swept(), 7.0, walls(0.1)

    def ticks(self, step_s: float, count: int, **changes: Any) -> list[int]:
        """Run `count` ticks, `step_s` apart; return the number of looks in each."""
        numbers = []
        for _ in range(count):
            self.now_s += step_s
            before = self.law.summary()["looks"]
            self.law.sense(replace(situation(ball_pose(), self.objects), **changes), self.now_s)
            numbers.append(self.law.summary()["looks"] - before)
        return numbers


@pytest.fixture
def watched() -> Watched:
    return Watched()


@pytest.mark.parametrize("lateral", [(0.0, 0.0), (0.5, 0.2)])
@pytest.mark.parametrize(("step_s", "every"), [(0.001, 8), (0.004, 2), (0.005, 2), (0.008, 1), (0.02, 1), (0.2, 1)])
def test_a_moving_gripper_is_looked_along_every_side_as_often_as_a_controller_is_written_to(
    watched: Watched, step_s: float, every: int, lateral: tuple[float, float]
) -> None:
    sides = 2 + (lateral != (0.0, 0.0))
    found = watched.ticks(step_s, 4 * every, joint_velocities_rad_s=SLOWLY, lateral=lateral)
    assert found == [sides, *[0] * (every - 1)] * 4


def test_the_trigger_against_which_the_gripper_moves_is_looked_along_less_often(watched: Watched) -> None:
    assert watched.ticks(0.008, 9, joint_velocities_rad_s=FORTH) == [2, 1, 1, 1, 2, 1, 1, 1, 2]


def test_at_rest_looks_are_rare_until_something_moves(watched: Watched) -> None:
    assert watched.ticks(0.005, 21) == [2, *[0] * 9] * 2 + [2]
    assert watched.ticks(0.005, 3, joint_velocities_rad_s=SLOWLY) == [2, 0, 2]


@pytest.mark.parametrize(
    "changes",
    [
        {"lateral": (0.3, 0.0)},
        {"held": 0},
        {"compensation": "robot"},
        {"loop_age_s": 0.11},
        {"astray_m_s": 0.1},
        {"objects": walls(0.06)},
        {"pose": ball_pose(tool_position_m=[0.0, 0.0, 0.05])},
        {"pose": free_pose([[0.0, 0.0, 0.0]] * 2, [0.008] * 2)},
    ],
    ids=lambda changes: str(next(iter(changes))),
)
def test_a_change_is_looked_at_in_the_next_tick(watched: Watched, changes: dict[str, Any]) -> None:
    assert watched.ticks(0.004, 3) == [2, 0, 0]
    looks = watched.ticks(0.004, 3, **changes)
    assert looks[0] >= 2
    assert looks[1:] == [0, 0]


def test_a_stick_that_is_swapped_is_looked_along_at_once(watched: Watched) -> None:
    assert watched.ticks(0.004, 3, lateral=(1.0, 0.0)) == [3, 0, 0]
    assert watched.ticks(0.004, 3, lateral=(-1.0, 0.0)) == [3, 0, 0]


def test_objects_without_velocities_are_looked_at_in_each_new_frame_and_resting_ones_are_not(watched: Watched) -> None:
    watched.ticks(0.008, 3)
    for velocities, looks in ((None, 2), (np.zeros((1, 3)), 0)):
        for _ in range(3):
            watched.objects = replace(walls(0.1), velocities_m_s=velocities)
            assert watched.ticks(0.008, 1) == [looks]


def test_a_clock_that_goes_back_stops_no_looks(watched: Watched) -> None:
    watched.ticks(0.004, 3)
    watched.now_s -= 10.0
    assert watched.ticks(0.004, 1) == [2]


def test_another_probability_is_looked_at_in_the_next_tick(watched: Watched) -> None:
    assert watched.ticks(0.004, 2) == [2, 0]
    watched.law.expect(0.9)
    assert watched.ticks(0.004, 2) == [2, 0]


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
    np.testing.assert_allclose(found.r2.fast_m, expected.r2.fast_m, atol=EQUAL_M)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"joint_velocities_rad_s": np.zeros(7)}, "joint_velocities_rad_s = 7; valid: 6"),
        ({"lateral": (np.nan, 0.0)}, "lateral"),
        ({"gap_m": np.nan}, "gap_m"),
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
