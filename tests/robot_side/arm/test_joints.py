"""From an intent to joint velocities: tool motion, resolved rates and the arm's limits, compared with plain NumPy."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from common.arrays import FloatArray
from common.protocol.messages import Header, MotionCommand
from robot_side.arm.ability import ability
from robot_side.arm.commanded import commanded
from robot_side.arm.hindrance import Cause, Hindrance
from robot_side.arm.limits import ArmLimits, JointLimits
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.arm.tool_motion import ToolMotionSettings, tool_motion
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import random_rotation
from tests.helpers.tool_driver import PERIOD_S, ToolDriver

SETTINGS = ToolMotionSettings(trigger_speed_m_s=0.25, stick_speed_m_s=0.1, turn_speed_rad_s=0.5)
LIMITS = JointLimits(np.full(6, 10.0), np.full(6, 3.0))
RIGHT, DOWN, FORWARD = np.eye(3)
STILL, FREE = np.zeros(3), np.full(6, np.inf)
seeds = st.integers(0, 2**32 - 1)


def command(**hands: Any) -> MotionCommand:
    return MotionCommand(Header(epoch=1, sequence=1, sent_s=0.0), **({"l2": 0.0, "r2": 0.0} | hands))


def pose_with(jacobian: FloatArray, rotation: FloatArray) -> GripperPose:
    return dataclasses.replace(free_pose([STILL], [0.01]), tool_rotation=rotation, tool_jacobian=jacobian)


def motion(**hands: Any) -> tuple[FloatArray, FloatArray]:
    linear, angular = tool_motion(command(**hands), SETTINGS)
    return np.array(linear), np.array(angular)


@pytest.mark.parametrize(
    ("hands", "linear"),
    [
        ({"r2": 1.0}, 0.25 * FORWARD),
        ({"l2": 1.0}, -0.25 * FORWARD),
        ({"r2": 0.4}, 0.1 * FORWARD),
        ({"r2": 1.0, "l2": 0.75}, 0.0625 * FORWARD),
        ({"r2": 1.0, "l2": 1.0}, STILL),
        ({"lateral": (1.0, 0.0)}, 0.1 * RIGHT),
        ({"lateral": (-0.5, 0.0)}, -0.05 * RIGHT),
        ({"lateral": (0.0, 1.0)}, -0.1 * DOWN),
        ({"lateral": (0.0, -0.3)}, 0.03 * DOWN),
    ],
)
def test_triggers_and_left_stick_move_the_tool_without_turning_it(hands: dict[str, Any], linear: FloatArray) -> None:
    found, angular = motion(**hands)
    np.testing.assert_allclose(found, linear, atol=1e-15)
    np.testing.assert_array_equal(angular, STILL)


@pytest.mark.parametrize(
    ("turning", "towards"),
    [((1.0, 0.0), RIGHT), ((-1.0, 0.0), -RIGHT), ((0.0, 1.0), -DOWN), ((0.0, -1.0), DOWN), ((0.6, 0.8), None)],
)
def test_the_right_stick_turns_the_view_the_way_it_is_pushed(
    turning: tuple[float, float], towards: FloatArray | None
) -> None:
    linear, angular = motion(turning=turning)
    np.testing.assert_array_equal(linear, STILL)
    # The tip of the approach axis moves with ω × z.
    tip = np.cross(angular, FORWARD)
    expected = 0.5 * (turning[0] * RIGHT - turning[1] * DOWN) if towards is None else 0.5 * towards
    np.testing.assert_allclose(tip, expected, atol=1e-15)
    assert angular @ FORWARD == 0.0
    assert np.linalg.norm(angular) == pytest.approx(0.5 * math.hypot(*turning))


def jacobian_with(singular_values: FloatArray, seed: int, joints: int) -> FloatArray:
    random = np.random.default_rng(seed)
    left, _ = np.linalg.qr(random.standard_normal((6, 6)))
    right, _ = np.linalg.qr(random.standard_normal((joints, joints)))
    count = len(singular_values)
    result: FloatArray = (left[:, :count] * singular_values) @ right[:, :count].T
    return result


@settings(derandomize=True, deadline=None, max_examples=100)
@given(
    twist=hnp.arrays(np.float64, 6, elements=st.floats(-5.0, 5.0)),
    limits=hnp.arrays(np.float64, 6, elements=st.floats(0.01, 3.0)),
    seed=st.integers(0, 1000),
)
def test_limits_hold_and_keep_the_direction(twist: FloatArray, limits: FloatArray, seed: int) -> None:
    jacobian = jacobian_with(np.linspace(0.2, 1.0, 6), seed, 6)
    free, limited = joint_velocities(jacobian, twist, FREE), joint_velocities(jacobian, twist, limits)
    assert (np.abs(limited) <= limits * (1.0 + 1e-12)).all()
    # Of the same direction, and no shorter than necessary.
    np.testing.assert_allclose(limited * np.linalg.norm(free), free * np.linalg.norm(limited), atol=1e-9)
    assert limited @ free >= 0.0
    if (np.abs(free) > limits).any():
        assert np.max(np.abs(limited) / limits) == pytest.approx(1.0)
    else:
        np.testing.assert_array_equal(limited, free)


@pytest.mark.parametrize("joints", [5, 6, 7])
@pytest.mark.parametrize("smallest", [0.0, 1e-9, 1e-3, 0.02, 0.05, 0.0599, 0.06 - 1e-12, 0.06 + 1e-12, 0.0601, 0.1])
def test_the_solution_is_the_damped_one_on_both_sides_of_the_threshold(smallest: float, joints: int) -> None:
    """Above the threshold, where nothing is damped, the solver takes a path without singular values."""
    twist = np.random.default_rng(7).uniform(-0.2, 0.2, 6)
    for seed in range(20):
        singular_values = np.append(np.linspace(2.0, 0.3, min(joints, 6) - 1), smallest)
        jacobian = jacobian_with(singular_values, seed, joints)
        left, values, right = np.linalg.svd(jacobian, full_matrices=False)
        damping_squared = 0.06**2 * (1.0 - min(values[-1] / 0.06, 1.0) ** 2)
        expected = right.T @ (values / (values**2 + damping_squared) * (left.T @ twist))
        velocity = joint_velocities(jacobian, twist, np.full(joints, np.inf))
        np.testing.assert_allclose(velocity, expected, atol=1e-11)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=seeds, joints=st.integers(1, 9), least=st.sampled_from([0.0, 0.02, 0.2]))
def test_the_speed_is_that_of_the_resolved_rates(seed: int, joints: int, least: float) -> None:
    random = np.random.default_rng(seed)
    jacobian = random.normal(size=(6, joints))
    jacobian[:, 0] *= least
    limits = JointLimits(random.uniform(0.1, 2.0, joints), random.uniform(1.0, 10.0, joints))
    direction = random_rotation(random)[0]
    twist = np.concatenate([0.25 * direction, np.zeros(3)])
    rates = joint_velocities(jacobian, twist, limits.velocity_rad_s)
    speed_m_s = max(float((jacobian @ rates)[:3] @ direction), 1e-6)
    able = ability(pose_with(jacobian, np.eye(3)), limits, direction, 0.25)
    assert able.full_speed_m_s == pytest.approx(speed_m_s, abs=1e-12)
    assert able.acceleration_m_s2 == pytest.approx(
        speed_m_s / max(float((np.abs(rates) / limits.acceleration_rad_s2).max()), 1e-9), rel=1e-12
    )
    assert able.within_reach == (np.abs(jacobian @ rates - twist).max() <= 1e-6 * 0.25)


def test_where_the_arm_cannot_go_nothing_is_0_or_divided_by_it() -> None:
    stuck = np.diag([1.0, 1.0, 0.0, 1.0, 1.0, 1.0])
    able = ability(pose_with(stuck, np.eye(3)), LIMITS, FORWARD, 0.25)
    assert 0.0 < able.full_speed_m_s < 0.01
    assert 0.0 < able.acceleration_m_s2 < np.inf
    assert not able.within_reach


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
def test_the_simulated_arm_gives_that_speed_and_no_less_acceleration(direction: tuple[float, float, float]) -> None:
    driver = ToolDriver.load()
    pose = driver.pose(driver.wait(PERIOD_S))
    along = pose.tool_rotation @ np.array(direction)
    able = ability(pose, ArmLimits().of_joints(driver.arm.joint_count), along, 0.25)
    assert able.within_reach
    assert able.full_speed_m_s == pytest.approx(0.25)
    twist = np.concatenate([0.25 * along, np.zeros(3)])
    speeds = []
    for _ in range(60):
        here = driver.tool_m()
        driver.move(twist, PERIOD_S)
        speeds.append(float((driver.tool_m() - here) @ along) / PERIOD_S)
    assert max(speeds) == pytest.approx(0.25, rel=0.02)
    # From rest to nine tenths, at least as fast as predicted, but for the drives' own lag of some 30 ms.
    risen_s = PERIOD_S * int(np.argmax(np.array(speeds) > 0.9 * 0.25))
    assert risen_s < 0.9 * 0.25 / able.acceleration_m_s2 + 0.04


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
    commanded_m_s = rotation[:, 2] @ jacobian[:3] @ np.where(stays, 0.0, expected)

    found = commanded(hands, pose_with(jacobian, rotation), positions, limits, SETTINGS)
    np.testing.assert_allclose(found.velocity_rad_s, expected, rtol=1e-12, atol=1e-12)
    assert found.commanded_m_s == pytest.approx(commanded_m_s, abs=1e-12)
    # A turn counts as the speed 0.2 m from the tool's point.
    asked = np.concatenate([linear, 0.2 * angular])
    missed = asked - np.concatenate([jacobian[:3], 0.2 * jacobian[3:]]) @ np.where(stays, 0.0, expected)
    undone = min(float(np.linalg.norm(missed) / np.linalg.norm(asked)), 1.0)
    assert found.undone == pytest.approx(undone if undone > 0.01 else 0.0, abs=1e-9)
    assert (found.cause is None) == (found.undone == 0.0)

    stands = commanded(hands, pose_with(jacobian, rotation), positions, limits, SETTINGS, stands=True).velocity_rad_s
    linear[2] = max(0.0, linear[2])
    expected = joint_velocities(jacobian, np.concatenate([linear, angular]), limits.velocity_rad_s)
    np.testing.assert_allclose(stands, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("jacobian", "ends_rad", "fastest_rad_s", "expected"),
    [
        (np.eye(6), 1.0, 1.0, (0.0, None, 0)),
        (np.eye(6), 0.0, 1.0, (1.0, Cause.END, 3)),
        (np.diag([1.0, 1.0, 0.003, 1.0, 1.0, 1.0]), 1.0, 9.0, (1.0, Cause.SINGULARITY, 0)),
        (np.eye(6), 1.0, 0.05, (0.8, Cause.SPEED, 3)),
        (np.eye(6)[:, [0, 1, 3, 4, 5]].copy(order="C"), 1.0, 1.0, (1.0, Cause.JOINTS, 0)),
    ],
)
def test_what_is_left_undone_has_a_cause(
    jacobian: FloatArray, ends_rad: float, fastest_rad_s: float, expected: tuple[float, Cause | None, int]
) -> None:
    joints = jacobian.shape[1]
    limits = JointLimits(
        np.full(joints, fastest_rad_s), np.ones(joints), np.full(joints, -1.0), np.full(joints, ends_rad)
    )
    found = commanded(command(r2=1.0), pose_with(jacobian, np.eye(3)), np.zeros(joints), limits, SETTINGS)
    assert found.undone == pytest.approx(expected[0], abs=0.01)
    assert (found.cause, found.joint) == expected[1:]


def test_a_hindrance_is_told_once_and_in_words() -> None:
    hindrance, said = Hindrance(), []
    for undone in (0.2, 0.3, 0.2, 0.1, 0.2):
        hindrance.update(undone, Cause.END, 4)
        said.append(hindrance.text)
    assert said == [None, "joint 4 at its limit", "joint 4 at its limit", None, None]
    for cause in Cause:
        hindrance.update(1.0, cause, 2)
        said.append(hindrance.text)
    assert said[-4:-1] == ["near a singularity", "joint 2 at its fastest", "too few joints for this motion"]
    assert said[-1] == "at a bound of the workspace, or of speed"
    hindrance.end()
    assert (hindrance.text, hindrance.undone) == (None, 0.0)


def rates(jacobian: FloatArray, twist: float = 0.0, limit: float = math.inf) -> Callable[[], object]:
    return lambda: joint_velocities(jacobian, np.full(6, twist), np.full(6, limit))


def motors(jacobian: FloatArray, rotation: FloatArray, joints: int = 6) -> Callable[[], object]:
    return lambda: commanded(command(), pose_with(jacobian, rotation), np.zeros(joints), LIMITS, SETTINGS)


SIX, THREE = np.eye(6), np.eye(3)
REFUSED: list[tuple[Callable[[], object], str]] = [
    *((rates(np.where(SIX > 0.0, bad, 0.0)), "jacobian") for bad in (math.nan, math.inf, -math.inf)),
    *((rates(SIX, twist=bad), "twist") for bad in (math.nan, math.inf, -math.inf)),
    *((rates(SIX, limit=limit), "velocity_limits_rad_s") for limit in (0.0, -1.0, math.nan)),
    (rates(1e200 * jacobian_with(np.linspace(0.2, 2.0, 6), 1, 6), twist=1.0), "too large"),
    *((motors(SIX, np.where(np.arange(9).reshape(3, 3) == 3 + k, math.nan, THREE)), "tool_rotation") for k in range(3)),
    *((motors(np.full((6, 6), bad), THREE), "jacobian") for bad in (math.nan, math.inf)),
    (motors(SIX, THREE, joints=5), r"joint_positions_rad has the shape \(5,\)"),
]


@pytest.mark.parametrize(("call", "said"), REFUSED)
def test_what_is_not_finite_or_does_not_fit_is_named(call: Callable[[], object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        call()
