"""Volume that the gripper, inflated by D_σ and moved by δ, shares with the objects, by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common.roles import Role
from robot_side.gripper.held_object import grip, with_held
from robot_side.laws.enlarged_gripper import EnlargedGripper
from robot_side.overlap import sphere_box
from tests.helpers.field.fields import AHEAD, RADIUS_M, ball_pose
from tests.helpers.field.situations import FULL_SPEED_M_S, SIGMA_M, inputs, moving, situation, walls
from tests.helpers.gripper_poses import gripper_pose
from tests.helpers.perceived_scenes import Scene


def with_wall_m3(centre_m: float, gap_m: float = 0.05, sigma_m: float = SIGMA_M) -> float:
    """Return the overlap of the ball at this height, inflated, with a wall over the ball at 0."""
    wall = np.array([[0.0, 0.0, RADIUS_M + gap_m + 0.05]]), np.eye(3)[None], np.array([[0.5, 0.5, 0.05]])
    centers_m, radii_m = np.array([[0.0, 0.0, centre_m]]), np.array([RADIUS_M + sigma_m])
    return float(sphere_box(centers_m, radii_m, *wall)[0])


def one_percent(volume_m3: float) -> Any:
    return pytest.approx(volume_m3, rel=0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_it_is_the_ball_inflated_and_moved_along_the_trigger_that_leads(sign: float) -> None:
    enlarged, wall = EnlargedGripper(inputs()), walls(0.05) if sign > 0.0 else walls(None, 0.05)
    going = situation(
        ball_pose(), wall, joint_velocities_rad_s=moving(sign * 0.2 * AHEAD + [0.05, 0.0, 0.0]), loop_age_s=0.3
    )
    assert enlarged.overlap_m3(going) == one_percent(with_wall_m3(0.06))
    for trigger in ("l2", "r2"):
        assert enlarged.overlaps_m3(trigger, going) == {0: enlarged.overlap_m3(going)}
    still = replace(going, joint_velocities_rad_s=np.zeros(6))
    assert enlarged.overlap_m3(still) == 0.0
    assert enlarged.overlaps_m3("r2", still) == {}


def test_what_is_under_way_from_an_unknown_operator_counts_as_full_speed() -> None:
    unknown = situation(ball_pose(), walls(0.05), loop_age_s=0.25, loop_age_known=False)
    overlaps = EnlargedGripper(inputs()).overlaps_m3("r2", unknown)
    assert overlaps[0] == one_percent(with_wall_m3(0.25 * FULL_SPEED_M_S))


def test_another_probability_inflates_more_or_less() -> None:
    enlarged, near = EnlargedGripper(inputs()), situation(ball_pose(), walls(0.002))
    assert enlarged.overlap_m3(near) == one_percent(with_wall_m3(0.0, 0.002))
    enlarged.expect(0.5)
    assert enlarged.overlap_m3(near) == 0.0


def test_what_is_held_or_ignored_shares_nothing() -> None:
    objects = Scene().add(Role.TARGET).box([0.0, 0.0, 0.0], [0.03, 0.02, 0.03]).objects()
    whole, enlarged = gripper_pose(), EnlargedGripper(inputs())
    whole = with_held(whole, grip(objects, 0, whole))
    assert enlarged.overlap_m3(situation(whole, objects)) > 0.0
    assert enlarged.overlap_m3(situation(whole, objects, held=0)) == 0.0
    assert enlarged.overlap_m3(situation(whole, replace(objects, roles=(Role.IGNORED,)))) == 0.0
