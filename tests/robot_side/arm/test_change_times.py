"""Following trigger and sticks with change times of the tool gives the motion that the joints' acceleration allows."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from common.following import follow_together
from common.protocol.messages import Header, MotionCommand
from robot_side.arm.ability import change_times_s
from robot_side.arm.limits import ACCELERATION_RAD_S2, ArmLimits
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.arm.tool_motion import ToolMotionSettings, full_twists, tool_motion
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.scene import load_scene

STEP_S = 0.001
MOTION, LIMITS = ToolMotionSettings(), ArmLimits(velocity_rad_s=100.0)
SCENE = load_scene(None)
POSE = MujocoKinematics(SCENE).pose(MujocoArm(SCENE, Encoder(seed=1)).state(0.0))
asked = st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5)


def test_full_twists_are_what_full_commands_come_to() -> None:
    for axis, twist in enumerate(full_twists(MOTION)):
        full = np.eye(5)[axis].tolist()
        command = MotionCommand(Header(1, 1, 0.0), 0.0, full[0], (full[1], full[2]), (full[3], full[4]))
        np.testing.assert_array_equal(np.concatenate(tool_motion(command, MOTION)), twist)


@settings(max_examples=50)
@given(asked, asked)
def test_trigger_and_sticks_are_followed_as_the_joints_references_follow_them(
    began: list[float], then: list[float]
) -> None:
    joints = POSE.tool_jacobian.shape[1]
    changes_s = change_times_s(POSE, LIMITS.of_joints(joints), full_twists(MOTION))

    def rates(of: list[float]) -> np.ndarray:
        linear, angular = np.array(of) @ full_twists(MOTION)[:, :3], np.array(of) @ full_twists(MOTION)[:, 3:]
        twist = np.concatenate([POSE.tool_rotation @ linear, POSE.tool_rotation @ angular])
        return joint_velocities(POSE.tool_jacobian, twist, np.full(joints, 100.0))

    velocity, target, passed = rates(began), rates(then), np.zeros(joints)
    for _ in range(60):
        change = target - velocity
        share = min(1.0, ACCELERATION_RAD_S2 * STEP_S / max(float(np.abs(change).max()), 1e-12))
        passed += STEP_S * (velocity + 0.5 * share * change)
        velocity = velocity + share * change
    gained, followed = follow_together(np.array(began), np.array(then), changes_s, 60 * STEP_S)
    np.testing.assert_allclose(rates(followed.tolist()), velocity, atol=1e-6)
    np.testing.assert_allclose(rates(gained.tolist()), passed, atol=1e-5)
