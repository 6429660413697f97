"""The stick's rumble, and how roles and a held object change the fields."""

import math

import numpy as np
import pytest

from common.arrays import FloatArray
from common.reaction import HORIZON_S
from common.roles import Role
from common.touch_speed import touch_speed_m_s
from robot_side.gripper.held_object import grip, with_held
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.tick.sensed import Sensed
from tests.helpers.field.fields import AHEAD, RADIUS_M, ball_pose
from tests.helpers.field.situations import ACCELERATION_M_S2, SIGMA_M, STICK_SPEED_M_S, Senses
from tests.helpers.gripper_poses import OPENING_M, free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

RIGHT = np.array([1.0, 0.0, 0.0])
LOOP_AGE_S = 0.1


def reached_m(deflection: float, loop_age_s: float = LOOP_AGE_S) -> float:
    """Return the stopping distance D = u (t_d + h) + u²/2a (eq. 8)."""
    speed = STICK_SPEED_M_S * deflection
    return speed * (loop_age_s + HORIZON_S) + speed * speed / (2.0 * ACCELERATION_M_S2)


def wall_to(side: FloatArray, gap_m: float, role: Role = Role.OBSTACLE) -> PerceivedObjects:
    return Scene().add(role).half_space(-side, -RADIUS_M - gap_m).objects()


def rumble(objects: PerceivedObjects, lateral: tuple[float, float], loop_age_s: float = LOOP_AGE_S) -> float:
    return Senses().sense(ball_pose(), objects, lateral=lateral, loop_age_s=loop_age_s).rumble


# The stick


def test_a_stick_at_rest_rumbles_never_however_near_things_are() -> None:
    scene = Scene()
    for side in (RIGHT, -RIGHT, AHEAD, -AHEAD, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]):
        scene.add().half_space(-np.array(side), -RADIUS_M - 0.001)
    sensed = Senses().sense(ball_pose(), scene.objects())
    assert sensed.rumble == 0.0
    assert sensed.r2.fast_m[7] < 0.0


@pytest.mark.parametrize(
    ("lateral", "side"),
    [((1.0, 0.0), RIGHT), ((-1.0, 0.0), -RIGHT), ((0.0, 1.0), [0.0, -1.0, 0.0]), ((0.0, -1.0), [0.0, 1.0, 0.0])],
)
def test_it_rumbles_for_what_lies_where_the_stick_leads_and_for_nothing_else(
    lateral: tuple[float, float], side: list[float]
) -> None:
    towards = np.array(side)
    assert rumble(wall_to(towards, 0.02), lateral) == 1.0
    for elsewhere in (-towards, AHEAD, -AHEAD, np.cross(AHEAD, towards)):
        assert rumble(wall_to(elsewhere, 0.002), lateral) == 0.0
    # The stick's directions are those of the tool's frame, not the world's.
    rotation = random_rotation(np.random.default_rng(1))
    turned = Scene().add().half_space(-rotation @ towards, -RADIUS_M - 0.02).objects()
    assert Senses().sense(ball_pose(tool_rotation=rotation), turned, lateral=lateral).rumble == 1.0


def test_it_is_the_strength_at_what_a_reaction_and_the_loop_age_take_in_eighths() -> None:
    for loop_age_s in (0.0, 0.1, 0.5):
        here = SIGMA_M + reached_m(1.0, loop_age_s)
        gaps = np.linspace(here - 0.002, here + 0.016, 100)
        found = [rumble(wall_to(RIGHT, gap), (1.0, 0.0), loop_age_s) for gap in gaps]
        assert found == sorted(found, reverse=True)
        assert {8.0 * value for value in found} == set(range(9))
        # The first strength begins 9 mm or more before the contact distance, the last less than 3 mm before it.
        assert found[int(np.searchsorted(gaps, here))] == 1.0
        assert 0.009 < gaps[int(np.argmin(found))] - here < 0.012


def test_a_deflection_is_of_both_axes_and_ends_at_1() -> None:
    diagonal = Scene().add().half_space([-math.sqrt(0.5), math.sqrt(0.5), 0.0], -RADIUS_M - SIGMA_M - 0.05).objects()
    assert rumble(diagonal, (1.0, 1.0)) == rumble(diagonal, (math.sqrt(0.5), math.sqrt(0.5)))


def test_a_stick_that_leads_slowly_to_what_is_to_be_touched_rumbles_half_at_most() -> None:
    slow, fast = 0.4, 1.0
    assert slow * STICK_SPEED_M_S < touch_speed_m_s(0.25) < fast * STICK_SPEED_M_S
    for role, most in ((Role.TARGET, 0.5), (Role.OBSTACLE, 1.0)):
        assert rumble(wall_to(RIGHT, 0.0, role), (slow, 0.0)) == most
        assert rumble(wall_to(RIGHT, 0.0, role), (fast, 0.0)) == 1.0


def test_what_is_touched_slowly_enough() -> None:
    assert touch_speed_m_s(0.25) == pytest.approx(0.045)
    assert touch_speed_m_s(1.0) == pytest.approx(0.045)
    assert touch_speed_m_s(0.1) == pytest.approx(0.018)


# Roles and held objects


def one(role: Role, **changes: object) -> Sensed:
    scene = Scene().add(role).box([0.0, 0.0, 0.15], [0.2, 0.2, 0.05])
    return Senses().sense(ball_pose(), scene.add(Role.OBSTACLE).sphere([0.0, 0.0, 9.0], 0.1).objects(), **changes)


def test_a_support_is_to_be_touched_only_while_something_is_held() -> None:
    obstacle, support, placing = one(Role.OBSTACLE), one(Role.SUPPORT), one(Role.SUPPORT, held=1)
    assert support.r2 == obstacle.r2
    assert placing.r2.fast_m == obstacle.r2.fast_m
    assert placing.r2.slow_m == one(Role.TARGET).r2.slow_m
    # An obstacle stays an obstacle, whatever is held.
    assert one(Role.OBSTACLE, held=1).r2 == obstacle.r2


def test_what_is_ignored_is_not_felt() -> None:
    ignored = one(Role.IGNORED)
    assert ignored.r2.fast_m == (ignored.horizon_m,) * 8


def test_the_held_object_is_no_danger_to_what_holds_it() -> None:
    pose = gripper_pose()
    objects = Scene().add(Role.TARGET).box([0.0, 0.0, 0.0], [0.03, 0.02, 0.03]).objects()
    whole = with_held(pose, grip(objects, 0, pose))
    carried = Senses().sense(whole, objects, held=0, gap_m=0.06, lateral=(1.0, 0.0))
    assert carried.r2.fast_m == carried.r2.slow_m == carried.l2.fast_m == (carried.horizon_m,) * 8
    assert carried.rumble == 0.0


def test_what_the_held_object_comes_near_is_felt() -> None:
    """A held rod that protrudes ahead of the fingers meets a wall that is far from the fingers."""
    pose = gripper_pose()
    scene = Scene().add(Role.TARGET).box([0.0, 0.0, 0.08], [0.01, 0.01, 0.1])
    with_wall = scene.add().half_space([0.0, 0.0, -1.0], -0.22).objects()
    whole = with_held(pose, grip(with_wall, 0, pose))
    carried = Senses().sense(whole, with_wall, held=0, gap_m=0.02)
    # The rod's cover protrudes by 3 mm at most.
    free_m = 0.22 - 0.18 - SIGMA_M
    assert free_m - 0.003 - 0.012 < carried.r2.fast_m[0] < free_m - 0.009
    empty = Senses().sense(pose, with_wall, held=0, gap_m=0.02)
    assert empty.r2.fast_m[0] > free_m + 0.1


@pytest.mark.parametrize(("gap_m", "limited"), [(0.5 * SIGMA_M, 4), (2.1 * SIGMA_M, 0), (None, 0)])
def test_towards_the_target_a_finger_is_enlarged_by_half_the_gap_at_most(gap_m: float | None, limited: int) -> None:
    fingers = free_pose([[0.04, 0.0, 0.0], [-0.04, 0.0, 0.0]], [0.008] * 2, [True] * 2)
    target = Scene().add(Role.TARGET).box([0.0, 0.0, 0.0], [0.03, 0.02, 0.02]).objects()
    senses = Senses()
    senses.sense(fingers, target, gap_m=gap_m)
    assert senses.law.summary()["spheres_limited_by_gap"] == limited
    # The gap of the built-in gripper, which is open, limits no inflation here.
    assert 0.5 * OPENING_M > SIGMA_M
