import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.compiled.kernel import NUMBER, TRUTH, compiled, record_array
from robot_side.simulation.joint_drives import JointDrives
from robot_side.simulation.joint_reference import REFERENCE, JointReference, MotionLimits, advance_references
from robot_side.simulation.scene import load_scene

STEP_S = 0.001
LIMITS = MotionLimits(velocity_rad_s=2.0, acceleration_rad_s2=8.0, deceleration_rad_s2=12.0, windup_rad=0.02)
UNLIMITED = np.full(2, np.inf)


def standing(position: FloatArray | None = None) -> JointReference:
    return JointReference(np.zeros(2) if position is None else position, -UNLIMITED, UNLIMITED, LIMITS)


@compiled(record_array(REFERENCE), TRUTH, TRUTH, NUMBER, NUMBER, NUMBER, NUMBER)
def _advance(
    joints: Any, following: bool, ended: bool, step_s: float, fastest: float, acceleration: float, deceleration: float
) -> None:
    advance_references(joints, following, ended, step_s, fastest, acceleration, deceleration)


def advance(
    reference: JointReference, time_s: float, step_s: float, position_rad: FloatArray, velocity_rad_s: FloatArray
) -> None:
    """Move the references on by `step_s` from `time_s`, near these measured positions and velocities (n,)."""
    joints, limits = reference.joints, reference.limits
    joints["measured_position"], joints["measured_velocity"] = position_rad, velocity_rad_s
    most = limits.velocity_rad_s, limits.acceleration_rad_s2, limits.deceleration_rad_s2
    _advance(joints, *reference.follows(time_s), step_s, *most)


def follow(reference: JointReference, start_s: float, steps: int) -> FloatArray:
    """Advance with a drive that follows without error; the velocities (steps, n)."""
    velocities = []
    for step in range(steps):
        advance(reference, start_s + step * STEP_S, STEP_S, reference.position_rad, reference.velocity_rad_s)
        velocities.append(reference.velocity_rad_s)
    return np.array(velocities)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(seed=st.integers(0, 10_000))
def test_no_command_breaks_a_limit(seed: int) -> None:
    random = np.random.default_rng(seed)
    lower, upper = np.array([-0.3, -np.inf]), np.array([0.2, 0.5])
    reference = JointReference(np.zeros(2), lower, upper, LIMITS)
    measured = np.zeros(2)
    for step in range(400):
        if random.uniform() < 0.02:
            reference.command(random.uniform(-5.0, 5.0, 2), step * STEP_S + random.uniform(-0.05, 0.2))
        held = random.uniform() < 0.5
        advance(reference, step * STEP_S, STEP_S, measured, np.zeros(2) if held else reference.velocity_rad_s)
        assert (np.abs(reference.velocity_rad_s) <= 2.0 + 1e-12).all()
        assert (reference.position_rad >= lower).all()
        assert (reference.position_rad <= upper).all()
        assert (np.abs(reference.position_rad - measured) <= 0.02 + 1e-12).all()
        measured = measured if held else reference.position_rad


@settings(derandomize=True, deadline=None, max_examples=50)
@given(seed=st.integers(0, 10_000))
def test_no_sequence_of_commands_makes_it_jump(seed: int) -> None:
    random = np.random.default_rng(seed)
    reference = standing()
    for step in range(400):
        if random.uniform() < 0.02:
            reference.command(random.uniform(-5.0, 5.0, 2), step * STEP_S + random.uniform(-0.05, 0.2))
        before = reference.velocity_rad_s
        advance(reference, step * STEP_S, STEP_S, reference.position_rad, before)
        assert np.abs(reference.velocity_rad_s - before).max() <= 12.0 * STEP_S + 1e-12


def test_weak_servos_and_other_drives_may_lead_farther() -> None:
    nothing = np.zeros(4)
    drives = JointDrives(
        gear=np.array([1.0, 2.0, 1.0, 1.0]),
        gain=nothing,
        offset=nothing,
        stiffness=np.array([4000.0, 12.5, 50.0, 0.0]),
        damping=nothing,
        strongest=np.array([150.0, 5.0, np.inf, 87.0]),
    )
    # An eighth of 5 N m at 2² 12.5 N m/rad is 12.5 mrad.
    np.testing.assert_allclose(drives.windup_rad(0.005), [0.005, 0.0125, 0.02, 0.02])
    np.testing.assert_allclose(load_scene().robot.drives.windup_rad(0.005), 0.005)


@pytest.mark.parametrize("bad", [np.array([np.nan, 0.0]), np.array([np.inf, 0.0]), np.zeros(3), np.zeros((2, 1))])
def test_a_bad_command_changes_nothing(bad: FloatArray) -> None:
    reference = standing()
    reference.command(np.array([0.5, 0.0]), 10.0)
    with pytest.raises(ValueError, match="joint_velocity_rad_s"):
        reference.command(bad, 20.0)
    for time_s in (math.nan, math.inf):
        with pytest.raises(ValueError, match="valid_until_s"):
            reference.command(np.array([-0.5, 0.0]), time_s)
    np.testing.assert_allclose(follow(reference, 0.0, 200)[-1], [0.5, 0.0])


def test_bad_limits_are_named() -> None:
    for name in ("velocity_rad_s", "acceleration_rad_s2", "deceleration_rad_s2", "windup_rad"):
        for value in (0.0, -1.0, math.nan, math.inf):
            with pytest.raises(ValueError, match=name):
                MotionLimits(**{name: value})
