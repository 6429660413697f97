"""Gripper of a scene in any configuration of the arm, without physics."""

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import ArmState, GripperPose
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.scene import Scene


class PosedGripper:
    """Gripper of a scene, placed by eq. 4 in any configuration; the fingers stay as at the scene's start."""

    def __init__(self, scene: Scene) -> None:
        self.home_rad: FloatArray = scene.data.qpos[scene.robot.arm_positions].copy()
        self.fingers: FloatArray = scene.data.qpos[scene.robot.finger_positions].copy()
        self._kinematics = MujocoKinematics(scene)

    def at(self, joint_positions_rad: FloatArray) -> GripperPose:
        """Return the gripper's pose for the joint positions (n,)."""
        still = np.zeros_like(joint_positions_rad)
        return self._kinematics.pose(ArmState(0.0, joint_positions_rad, still, self.fingers, 0.0, False))
