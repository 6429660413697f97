"""The one call from a command to the joints, against the same in plain NumPy."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.protocol.messages import Header, MotionCommand
from robot_side.arm.ability import JointLimits
from robot_side.arm.commanded import commanded
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.arm.tool_motion import ToolMotionSettings
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import random_rotation

SETTINGS = ToolMotionSettings(trigger_speed_m_s=0.25, stick_speed_m_s=0.1, turn_speed_rad_s=0.5)
UNLIMITED = JointLimits(np.full(6, 10.0), np.full(6, 3.0))
MIDDLE = np.zeros(6)
seeds = st.integers(0, 2**32 - 1)


def command(**hands: Any) -> MotionCommand:
    return MotionCommand(Header(epoch=1, sequence=1, sent_s=0.0), **({"l2": 0.0, "r2": 0.0} | hands))


def pose_with(jacobian: FloatArray, rotation: FloatArray) -> GripperPose:
    return dataclasses.replace(free_pose([[0.0, 0.0, 0.0]], [0.01]), tool_rotation=rotation, tool_jacobian=jacobian)


@settings(derandomize=True, deadline=None, max_examples=100)
@given(seed=seeds, joints=st.integers(1, 8), least=st.sampled_from([0.0, 0.02, 0.2, 1.0]))
def test_it_is_the_twist_resolved_and_what_joints_at_their_ends_let_through(
    seed: int, joints: int, least: float
) -> None:
    random = np.random.default_rng(seed)
    rotation, jacobian = random_rotation(random), random.normal(size=(6, joints))
    jacobian[:, -1] *= least
    right, up, turn_right, turn_up = random.uniform(-1.0, 1.0, 4).tolist()
    l2, r2 = random.uniform(0.0, 1.0, 2).tolist()
    hands = command(l2=l2, r2=r2, lateral=(right, up), turning=(turn_right, turn_up))
    positions = random.uniform(-1.0, 1.0, joints)
    lower, upper = (positions + random.choice([-1.0, -0.0021, -0.0019, 0.1], joints) for _ in range(2))
    limits = JointLimits(random.uniform(0.05, 1.0, joints), np.ones(joints), lower, 2.0 * positions - upper)

    linear = rotation @ [0.1 * right, -0.1 * up, 0.25 * (r2 - l2)]
    angular = rotation @ [0.5 * turn_up, 0.5 * turn_right, 0.0]
    expected = joint_velocities(jacobian, np.concatenate([linear, angular]), limits.velocity_rad_s)
    stays = ((positions <= limits.ends_rad[0] + 0.002) & (expected < 0.0)) | (
        (positions >= limits.ends_rad[1] - 0.002) & (expected > 0.0)
    )
    told_m_s = rotation[:, 2] @ jacobian[:3] @ np.where(stays, 0.0, expected)

    velocity, told = commanded(hands, pose_with(jacobian, rotation), positions, limits, SETTINGS)
    np.testing.assert_allclose(velocity, expected, rtol=1e-12, atol=1e-12)
    assert told == pytest.approx(told_m_s, abs=1e-12)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_moves_nothing(bad: float) -> None:
    for row in range(3):
        rotation = np.eye(3)
        rotation[1, row] = bad
        with pytest.raises(ValueError, match="tool_rotation"):
            commanded(command(), pose_with(np.eye(6), rotation), MIDDLE, UNLIMITED, SETTINGS)
    with pytest.raises(ValueError, match="jacobian"):
        commanded(command(), pose_with(np.full((6, 6), bad), np.eye(3)), MIDDLE, UNLIMITED, SETTINGS)


def test_positions_of_other_joints_are_refused() -> None:
    with pytest.raises(ValueError, match=r"joint_positions_rad has the shape \(5,\)"):
        commanded(command(), pose_with(np.eye(6), np.eye(3)), np.zeros(5), UNLIMITED, SETTINGS)
