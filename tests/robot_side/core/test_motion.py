"""The motion that the robot side reports for an operator's command equals the motion that it commands to the arm."""

import numpy as np
import pytest

from common.arrays import FloatArray
from common.protocol.messages import Header, MotionCommand
from robot_side.arm.port import Arm, ArmState
from robot_side.core.motion import Motion
from robot_side.gripper.grip import Grip
from robot_side.operators.safety import Permission
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings

PARTS = build_parts(RobotSettings(), 1, "clock")


class ToldArm(Arm):
    joint_count = PARTS.arm.joint_count

    def __init__(self) -> None:
        self.told: list[tuple[FloatArray, float]] = []
        self.gripper: list[tuple[float, float]] = []

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        self.told.append((joint_velocity_rad_s, valid_until_s))

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        self.gripper.append((closing, valid_until_s))

    def state(self, now_s: float) -> ArmState:
        return PARTS.arm.state(now_s)


@pytest.mark.parametrize("permitted", [True, False])
@pytest.mark.parametrize("gives_way", [True, False])
def test_the_arm_is_told_what_is_said(permitted: bool, gives_way: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    arm, grip, now_s = ToldArm(), Grip(PARTS.surroundings), 1.0
    monkeypatch.setattr(type(grip.touchdown), "gives_way", property(lambda _: gives_way))
    motion, state = Motion(arm, PARTS.limits, PARTS.motion), arm.state(now_s)
    command = MotionCommand(Header(1, 1, 0.0), l2=0.0, r2=0.4, gripper=1.0, run=True) if permitted else None
    motion.command(Permission("armed", command, 1.1), PARTS.kinematics.pose(state), state, grip, None, now_s)
    [(velocity, until_s)], [told_gripper] = arm.told, arm.gripper
    if permitted and not gives_way:
        assert motion.commanded_rad_s is velocity
        assert np.abs(velocity).max() > 0.01
        assert motion.commanded_m_s == pytest.approx(0.1, rel=0.01)
        assert (until_s, told_gripper) == (1.1, (1.0, 1.1))
    else:
        assert motion.commanded_rad_s is None
        assert (not velocity.any(), until_s, told_gripper) == (True, state.time_s, (0.0, now_s))
        assert motion.commanded_m_s == 0.0
