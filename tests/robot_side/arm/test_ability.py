"""What the arm can do along a direction, against the pseudo-inverse and the simulated arm's own limits."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.arm.ability import JointLimits, ability
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.simulation.joint_reference import MotionLimits
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import random_rotation
from tests.helpers.tool_driver import PERIOD_S, ToolDriver

AHEAD = np.array([0.0, 0.0, 1.0])
FREE = JointLimits(np.full(6, 10.0), np.full(6, 3.0))
seeds = st.integers(0, 2**32 - 1)


def pose_with(jacobian: np.ndarray) -> GripperPose:
    return dataclasses.replace(free_pose([[0.0, 0.0, 0.0]], [0.01]), tool_jacobian=jacobian)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=seeds, joints=st.integers(1, 9), least=st.sampled_from([0.0, 0.02, 0.2]))
def test_it_is_what_the_resolved_rates_come_to(seed: int, joints: int, least: float) -> None:
    random = np.random.default_rng(seed)
    jacobian = random.normal(size=(6, joints))
    jacobian[:, 0] *= least
    limits = JointLimits(random.uniform(0.1, 2.0, joints), random.uniform(1.0, 10.0, joints))
    direction = random_rotation(random)[0]
    twist = np.concatenate([0.25 * direction, np.zeros(3)])
    rates = joint_velocities(jacobian, twist, limits.velocity_rad_s)
    speed_m_s = max(float((jacobian @ rates)[:3] @ direction), 1e-6)
    able = ability(pose_with(jacobian), limits, direction, 0.25)
    assert able.full_speed_m_s == pytest.approx(speed_m_s, abs=1e-12)
    assert able.acceleration_m_s2 == pytest.approx(
        speed_m_s / max(float((np.abs(rates) / limits.acceleration_rad_s2).max()), 1e-9), rel=1e-12
    )
    assert able.within_reach == (np.abs(jacobian @ rates - twist).max() <= 1e-6 * 0.25)


def test_where_the_arm_cannot_go_nothing_is_0_or_divided_by_it() -> None:
    stuck = np.diag([1.0, 1.0, 0.0, 1.0, 1.0, 1.0])
    able = ability(pose_with(stuck), FREE, AHEAD, 0.25)
    assert 0.0 < able.full_speed_m_s < 0.01
    assert 0.0 < able.acceleration_m_s2 < np.inf
    assert not able.within_reach


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
def test_the_simulated_arm_gives_that_speed_and_no_less_acceleration(direction: tuple[float, float, float]) -> None:
    driver = ToolDriver.load()
    pose = driver.pose(driver.wait(PERIOD_S))
    along = pose.tool_rotation @ np.array(direction)
    able = ability(pose, MotionLimits().of_joints(driver.arm.joint_count), along, 0.25)
    assert able.within_reach
    assert able.full_speed_m_s == pytest.approx(0.25)
    twist = np.concatenate([0.25 * along, np.zeros(3)])
    speeds = []
    for _ in range(60):
        here = driver.tool_m()
        driver.move(twist, PERIOD_S)
        speeds.append(float((driver.tool_m() - here) @ along) / PERIOD_S)
    assert max(speeds) == pytest.approx(0.25, rel=0.02)
    # From rest to nine tenths, at least as fast as said, but for the drives' own lag of some 30 ms.
    risen_s = PERIOD_S * int(np.argmax(np.array(speeds) > 0.9 * 0.25))
    assert risen_s < 0.9 * 0.25 / able.acceleration_m_s2 + 0.04
