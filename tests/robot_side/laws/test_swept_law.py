"""The swept law's fields: their horizon, the displacement that the law computes itself, and its use of eq. 9-10."""

import math
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from common.reaction import HORIZON_S
from robot_side.enlargement.prediction_errors import PredictionErrors
from robot_side.laws.prospect import BEYOND_M
from tests.helpers.field.fields import AHEAD, ball_pose
from tests.helpers.field.situations import (
    ACCELERATION_M_S2,
    EXACT,
    FULL_SPEED_M_S,
    SIGMA_M,
    Senses,
    at,
    moving,
    swept,
    walls,
)
from tests.helpers.gripper_poses import FRONT_M, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

GRIPPER = gripper_pose()


def horizon_m(loop_age_s: float) -> float:
    braking_m = FULL_SPEED_M_S**2 / (2.0 * ACCELERATION_M_S2)
    return FULL_SPEED_M_S * (loop_age_s + HORIZON_S) + braking_m + BEYOND_M


# Horizon


@pytest.mark.parametrize("loop_age_s", [0.001, 0.1, 0.4, 1.0])
def test_the_horizon_is_what_a_reaction_the_loop_age_and_braking_take_and_a_little_more(loop_age_s: float) -> None:
    sensed = Senses().sense(GRIPPER, walls(None), loop_age_s=loop_age_s)
    assert sensed.horizon_m == pytest.approx(horizon_m(loop_age_s), rel=1e-12)
    for felt in (sensed.l2, sensed.r2):
        assert felt.fast_m == felt.slow_m == (sensed.horizon_m,) * 8
        assert felt.full_speed_m_s == pytest.approx(FULL_SPEED_M_S)
        assert felt.acceleration_m_s2 == pytest.approx(ACCELERATION_M_S2)
        assert felt.course_stiffness == 0.0


def test_nothing_is_claimed_of_what_has_not_been_looked_at() -> None:
    """Between two looks the loop age may jump up, and the tool may move. What lies beyond is unknown."""
    senses = Senses(step_s=0.001)
    near = senses.sense(at(0.0), walls(0.2), loop_age_s=0.1)
    jumped = senses.sense(at(0.004), walls(0.2), loop_age_s=1.0)
    reach_m = horizon_m(0.1) + 0.02 * FULL_SPEED_M_S
    assert near.horizon_m == pytest.approx(horizon_m(0.1))
    assert jumped.horizon_m == pytest.approx(reach_m - 0.004)
    assert jumped.r2.fast_m == (jumped.horizon_m,) * 8
    senses.step_s = 0.011
    for _ in range(2):
        looked = senses.sense(at(0.004), walls(0.2), loop_age_s=1.0)
    assert looked.horizon_m == pytest.approx(horizon_m(1.0))
    assert looked.r2.fast_m[7] < 0.2


def test_the_ways_are_the_same_at_every_loop_age() -> None:
    """The delay moves the gripper along the path. It does not enlarge the gripper, so the distances are the same."""
    expected = Senses().sense(GRIPPER, walls(0.05, front_m=FRONT_M), loop_age_s=0.0)
    for loop_age_s in (0.05, 0.2, 0.8):
        ahead = moving(0.2 * AHEAD)
        found = Senses().sense(
            GRIPPER, walls(0.05, front_m=FRONT_M), loop_age_s=loop_age_s, joint_velocities_rad_s=ahead
        )
        np.testing.assert_allclose(found.r2.fast_m, expected.r2.fast_m, atol=1e-9)


# The displacement by the robot side's own prediction


def test_while_it_is_not_known_what_is_under_way_full_speed_is() -> None:
    for speed_m_s in (0.0, 0.1, -0.1):
        velocity = moving(speed_m_s * AHEAD)
        sensed = Senses().sense(GRIPPER, joint_velocities_rad_s=velocity, loop_age_s=0.5, loop_age_known=False)
        assert sensed.r2.displacement_m == pytest.approx(0.5 * FULL_SPEED_M_S)
        assert sensed.l2.displacement_m == pytest.approx(0.5 * FULL_SPEED_M_S)


# Eq. 9-10 as the law applies it


def test_a_camera_that_sees_things_too_near_lengthens_the_ways_on_its_side_and_shortens_the_others() -> None:
    """μ_c is the mean of true minus perceived position: with 5 mm along the approach, objects are 5 mm farther."""
    rotation = random_rotation(np.random.default_rng(2))
    approach = rotation[:, 2]
    # With a sphere this large, inflation hardly changes how its overlap with a wall grows.
    pose = ball_pose(0.1, tool_rotation=rotation)
    scene = Scene()
    for side in (-1.0, 1.0):
        scene.add().half_space(-side * approach, -0.17)
    plain, known = (
        Senses(swept(camera_mean_m=tuple(mean_m * approach), camera_sd_m=0.01)).sense(pose, scene.objects())
        for mean_m in (0.0, 0.005)
    )
    np.testing.assert_allclose(np.array(known.r2.fast_m) - plain.r2.fast_m, 0.005, atol=1e-4)
    np.testing.assert_allclose(np.array(known.l2.fast_m) - plain.l2.fast_m, -0.005, atol=1e-4)
    # An arm 5 mm less far along the approach than estimated has the same effect.
    arm = Senses(swept(kinematic_mean_m=tuple(-0.005 * approach), camera_sd_m=0.01)).sense(pose, scene.objects())
    np.testing.assert_allclose(arm.r2.fast_m, known.r2.fast_m, atol=1e-9)
    np.testing.assert_allclose(arm.l2.fast_m, known.l2.fast_m, atol=1e-9)


def test_prediction_errors_are_those_of_the_predicting_side() -> None:
    missed = PredictionErrors({"operator": ((0.2, 0.001, 0.0),), "robot": ((0.2, 0.0, 0.02),)})
    pose, wall = ball_pose(0.1), walls(0.15, front_m=0.1)

    def onsets(prediction: PredictionErrors, **changes: Any) -> FloatArray:
        return np.array(Senses(swept(prediction=prediction)).sense(pose, wall, loop_age_s=0.2, **changes).r2.fast_m)

    exact = onsets(EXACT)
    np.testing.assert_allclose(exact - onsets(missed, compensation="operator"), 0.001, atol=1e-4)
    robot = 2.3263478740408408 * math.hypot(0.003, 0.02)
    np.testing.assert_allclose(exact - onsets(missed, compensation="robot"), robot - SIGMA_M, atol=6e-4)
    # Without a table, a fifth of the displacement at full speed in the loop age is added.
    np.testing.assert_allclose(exact - onsets(PredictionErrors()), 0.2 * FULL_SPEED_M_S * 0.2, atol=3e-4)


# The figures of the summary


def test_the_enlargement_by_hand() -> None:
    velocity_m_s, loop_age_s = 0.2, 0.3
    for sign, ahead_m, behind_m in ((1.0, 0.05, None), (-1.0, None, 0.05)):
        senses = Senses()
        velocity = moving(sign * velocity_m_s * AHEAD + [0.05, 0.0, 0.0])
        sensed = senses.sense(
            ball_pose(), walls(ahead_m, behind_m), joint_velocities_rad_s=velocity, loop_age_s=loop_age_s
        )
        assert sensed.enlargement_m == pytest.approx(loop_age_s * math.hypot(velocity_m_s, 0.05) + SIGMA_M)


# Impossible values


def test_velocities_that_are_not_finite_are_an_error() -> None:
    with pytest.raises(ValueError, match="valid: "):
        Senses().sense(GRIPPER, walls(0.1), joint_velocities_rad_s=np.full(6, math.nan))
