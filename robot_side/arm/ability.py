"""Speed and acceleration that the tool can reach along a direction in one pose, within the joints' limits."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import joint_velocities, velocities_for

_MET = 1e-6
"""Largest deviation of the tool's motion from the commanded motion that counts as none, as a share of full speed"""
_LEAST_SPEED_M_S = 1e-6
_LEAST_S = 1e-9
_NO_TURN = np.zeros(3)


@dataclass(frozen=True)
class Ability:
    """Speed and acceleration that the tool can reach along one direction."""

    full_speed_m_s: float
    """v_max in this pose: speed at full travel of a trigger, after the joints' limits and damping near a singularity"""
    acceleration_m_s2: float
    """a in this pose: acceleration along the direction when the joint that needs longest accelerates at its limit"""
    within_reach: bool
    """Whether the tool moves as commanded at full travel."""


def ability(pose: GripperPose, limits: JointLimits, direction: FloatArray, full_speed_m_s: float) -> Ability:
    """Return the tool's ability at full travel of a trigger along the unit vector `direction` (3,), by joint speeds.

    full_speed_m_s: v_max of the settings.
    """
    twist, jacobian = np.concatenate([full_speed_m_s * direction, _NO_TURN]), pose.tool_jacobian
    rates = joint_velocities(jacobian, twist, limits.velocity_rad_s)
    given = jacobian @ rates
    speed_m_s = max(float(given[:3] @ direction), _LEAST_SPEED_M_S)
    changing_s = max(float((np.abs(rates) / limits.acceleration_rad_s2).max()), _LEAST_S)
    off = float(np.abs(given - twist).max())
    return Ability(speed_m_s, speed_m_s / changing_s, within_reach=off <= _MET * full_speed_m_s)


def along_approach(pose: GripperPose, limits: JointLimits, full_speed_m_s: float) -> Ability:
    """Return the ability along the tool's approach axis."""
    return ability(pose, limits, pose.tool_rotation[:, 2], full_speed_m_s)


def change_times_s(pose: GripperPose, limits: JointLimits, twists: FloatArray) -> FloatArray:
    """Return the times K (n, 5) from rest to full travel of R2 and to each full stick deflection, for each joint, in s.

    A change Δ (5,) of travel and stick deflections takes max |K Δ|: the joint that changes most limits all. twists (5,
    6): from `tool_motion.full_twists`. ValueError as for `joint_velocities`.
    """
    turned = (twists.reshape(-1, 2, 3) @ pose.tool_rotation.T).reshape(-1, 6)
    rates = velocities_for(pose.tool_jacobian, turned, limits.velocity_rad_s)
    times_s: FloatArray = (rates / limits.acceleration_rad_s2).T
    return times_s
