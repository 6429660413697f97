"""Estimate of joints and fingers from noisy readings, compared with the same filters in NumPy; and its restarts."""

from dataclasses import replace

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.joint_estimate import JointEstimate
from robot_side.arm.port import ArmState


def state(time_s: float, joints: FloatArray, velocities: FloatArray, fingers: FloatArray) -> ArmState:
    return ArmState(time_s, joints, velocities, fingers, 0.08, gripper_holding=False)


def test_it_is_a_complementary_filter_and_an_alpha_beta_filter() -> None:
    """Both filters equal those in plain NumPy, over time steps of different lengths."""
    random, estimate, time_s = np.random.default_rng(6), JointEstimate(), 0.0
    joints, fingers, finger_velocities = np.zeros(5), np.zeros(2), np.zeros(2)
    last_velocities = np.zeros(5)
    estimate.update(state(time_s, joints, last_velocities, fingers))
    for _ in range(200):
        since_s = random.uniform(1e-4, 0.05)
        time_s += since_s
        velocities = random.uniform(-0.1, 0.1, 5)
        joints = joints + 0.5 * since_s * (last_velocities + velocities)
        fingers = fingers + since_s * finger_velocities
        read, fingers_read = joints + 5e-3 * random.uniform(-1, 1, 5), fingers + 5e-3 * random.uniform(-1, 1, 2)
        share = 1.0 - np.exp(-since_s / 0.02)
        finger_velocities = finger_velocities + share**2 / (2.0 - share) / since_s * (fingers_read - fingers)
        joints, fingers = joints + share * (read - joints), fingers + share * (fingers_read - fingers)
        last_velocities = velocities
        seen = estimate.update(state(time_s, read, velocities, fingers_read))
        np.testing.assert_allclose(seen.joint_positions_rad, joints, atol=1e-12)
        np.testing.assert_allclose(seen.finger_positions, fingers, atol=1e-12)
        np.testing.assert_array_equal(seen.joint_velocities_rad_s, velocities)


def test_a_state_that_was_seen_changes_nothing() -> None:
    estimate = JointEstimate()
    one = state(0.0, np.array([1.0]), np.zeros(1), np.zeros(1))
    first = estimate.update(one)
    again = replace(one, time_s=1e-3, joint_positions_rad=np.array([1.001]))
    second = estimate.update(again)
    assert estimate.update(again) is second
    assert first.joint_positions_rad[0] < second.joint_positions_rad[0] < 1.001


@pytest.mark.parametrize("gap_s", [0.1, 5.0, -1.0])
def test_after_a_gap_or_a_jump_it_begins_anew(gap_s: float) -> None:
    estimate = JointEstimate()
    estimate.update(state(1.0, np.array([0.0]), np.array([1.0]), np.zeros(1)))
    later = state(1.0 + gap_s, np.array([0.005]), np.array([1.0]), np.zeros(1))
    assert estimate.update(later) is later
    jumped = replace(later, time_s=later.time_s + 1e-3, joint_positions_rad=np.array([0.5]))
    assert estimate.update(jumped) is jumped
    unknown = replace(jumped, time_s=jumped.time_s + 1e-3, joint_positions_rad=np.array([np.nan]))
    assert estimate.update(unknown) is unknown
    other = state(unknown.time_s + 1e-3, np.zeros(3), np.zeros(3), np.zeros(0))
    assert estimate.update(other) is other
