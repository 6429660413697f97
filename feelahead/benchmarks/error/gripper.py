"""A scene's gripper in any configuration, and what the arm's joints allow there."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.simulation.joint_reference import MotionLimits
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import Scene

_MET = 1e-6
"""A tool that moves as asked but for this share is held back by nothing."""
_LEAST_SPEED_M_S = 1e-6
_LEAST_RATE_RAD_S = 1e-9


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


@dataclass(frozen=True)
class Ability:
    """What the arm can do along the approach axis in one pose."""

    full_speed_m_s: float
    """v_max here: what full travel gives, once the joints' limits and the damping at a singularity are through."""
    acceleration_m_s2: float
    """a here: the least that the speed can change, with the joint that moves most at its limit."""
    within_reach: bool
    """Full travel moves the tool as it is meant to."""


def ability(pose: GripperPose, limits: MotionLimits, full_speed_m_s: float) -> Ability:
    """Resolve full travel into joint speeds, as the robot side does, and see what they come to.

    full_speed_m_s: v_max as it is set.
    """
    twist = np.concatenate([full_speed_m_s * pose.tool_rotation[:, 2], np.zeros(3)])
    most = np.full(pose.tool_jacobian.shape[1], limits.velocity_rad_s)
    rates = joint_velocities(pose.tool_jacobian, twist, most)
    given = pose.tool_jacobian @ rates
    speed_m_s = max(float(given[:3] @ pose.tool_rotation[:, 2]), _LEAST_SPEED_M_S)
    largest = max(float(np.abs(rates).max()), _LEAST_RATE_RAD_S)
    return Ability(
        full_speed_m_s=speed_m_s,
        acceleration_m_s2=limits.acceleration_rad_s2 * speed_m_s / largest,
        within_reach=bool(np.abs(given - twist).max() <= _MET * full_speed_m_s),
    )
