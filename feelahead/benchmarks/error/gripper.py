"""A scene's gripper in any configuration."""

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import ArmState, GripperPose
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import Scene


class PosedGripper:
    """Where eq. 4 puts the gripper; the fingers stay as the scene starts."""

    def __init__(self, scene: Scene) -> None:
        robot = scene.robot
        self.home_rad: FloatArray = scene.data.qpos[robot.arm_positions].copy()
        # A joint without limits is taken over one turn.
        self.lower_rad: FloatArray = np.where(np.isfinite(robot.lower_rad), robot.lower_rad, -np.pi)
        self.upper_rad: FloatArray = np.where(np.isfinite(robot.upper_rad), robot.upper_rad, np.pi)
        self._fingers = scene.data.qpos[robot.finger_positions].copy()
        self._kinematics = MujocoKinematics(scene)

    def at(self, joint_positions_rad: FloatArray) -> GripperPose:
        """The gripper with its joints (n,) there."""
        still = np.zeros_like(joint_positions_rad)
        return self._kinematics.pose(
            ArmState(
                time_s=0.0,
                joint_positions_rad=joint_positions_rad,
                joint_velocities_rad_s=still,
                finger_positions=self._fingers,
                gripper_opening_m=0.0,
                gripper_holding=False,
            )
        )
