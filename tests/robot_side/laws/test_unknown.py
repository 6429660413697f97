"""Space that nobody has seen is felt with half strength at most, ahead and not beside."""

from dataclasses import replace

import numpy as np
import pytest

from robot_side.laws.unknown import HALF
from robot_side.surroundings.perceived import PerceivedObjects, UnknownSpace
from tests.helpers.field.fields import RADIUS_M
from tests.helpers.field.situations import Senses, at, moving, walls

FAR_M = 0.5


def unseen(*boxes: list[list[float]], wall_m: float = FAR_M) -> PerceivedObjects:
    """Return a wall, and unseen space in these boxes (lower and upper corners)."""
    unknown = UnknownSpace(1.0, 0.0, 0.0, 0.0, 0.0, np.array(boxes).reshape(-1, 2, 3))
    return replace(walls(wall_m), unknown=unknown)


def box(from_m: float, to_m: float, across_m: float = 0.0) -> list[list[float]]:
    """Return a box of unseen space, by its distances ahead of the gripper, and how far it is aside."""
    low, high = RADIUS_M + from_m, RADIUS_M + to_m
    return [[across_m - 0.1, -0.1, low], [across_m + 0.1, 0.1, high]]


def test_unseen_space_is_felt_where_a_wall_there_would_be_and_up_to_half() -> None:
    wall = Senses().sense(at(0.0), walls(0.03)).r2
    found = Senses().sense(at(0.0), unseen(box(0.03, 0.13))).r2
    for felt, as_wall in ((found.fast_m, wall.fast_m), (found.slow_m, wall.slow_m)):
        assert felt[:HALF] == pytest.approx(as_wall[:HALF], abs=1e-4)
        assert min(felt[HALF:]) > 0.1
    assert max(wall.fast_m) < 0.05


def test_several_boxes_of_one_space_are_felt_as_one() -> None:
    whole = Senses().sense(at(0.0), unseen(box(0.03, 0.13))).r2
    parts = Senses().sense(at(0.0), unseen(*(box(low, low + 0.02) for low in (0.03, 0.05, 0.07, 0.09, 0.11)))).r2
    assert parts.fast_m == pytest.approx(whole.fast_m, abs=1e-4)


def test_a_nearer_obstacle_keeps_its_strength_and_unseen_space_beside_the_way_is_not_felt() -> None:
    alone = Senses().sense(at(0.0), walls(0.03)).r2
    assert Senses().sense(at(0.0), unseen(box(0.06, 0.16), wall_m=0.03)).r2 == alone
    beside = Senses().sense(at(0.0), unseen(box(0.0, 0.3, across_m=0.15 + RADIUS_M), wall_m=0.03)).r2
    assert beside == alone


def test_a_gripper_that_has_been_far_from_all_feels_it_on_its_way() -> None:
    senses = Senses(step_s=0.01)
    drift = {"joint_velocities_rad_s": moving(np.array([0.1, 0.0, 0.0])), "compensation": "robot"}
    senses.sense(at(0.0), unseen(), **drift)
    # It drifts aside, to where unseen space is ahead.
    felt = senses.sense(at(0.0, across_m=0.001), unseen(box(0.02, 0.2, across_m=0.12 + RADIUS_M)), **drift).r2
    assert felt.fast_m[HALF - 1] < 0.1 < felt.fast_m[HALF]
