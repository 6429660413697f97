"""Base class of arms that differ from another arm in one respect."""

from common.arrays import FloatArray
from robot_side.arm.port import Arm, ArmState


class PassedOnArm(Arm):
    joint_count = 0

    def __init__(self, arm: Arm) -> None:
        self.joint_count, self.arm = arm.joint_count, arm

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        self.arm.command(joint_velocity_rad_s, valid_until_s)

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        self.arm.command_gripper(closing, valid_until_s)

    def state(self, now_s: float) -> ArmState:
        return self.arm.state(now_s)
