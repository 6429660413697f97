"""What the arm can do along a direction in one pose: how fast, and how fast its speed changes there."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import joint_velocities

_MET = 1e-6
"""A tool that moves as asked but for this share is held back by nothing."""
_LEAST_SPEED_M_S = 1e-6
_LEAST_RATE_RAD_S = 1e-9
_AT_END_RAD = 0.002
"""A joint that holds at its end is this near to it: encoders are noisy."""


@dataclass(frozen=True)
class JointLimits:
    """What the arm's own controller allows its joints, (n,) each; metres for a prismatic joint."""

    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
    lower_rad: FloatArray | None = None
    """Where each joint ends; None for one that nobody knows, or for none."""
    upper_rad: FloatArray | None = None

    def given(self, velocities_rad_s: FloatArray, positions_rad: FloatArray) -> FloatArray:
        """What commanded velocities (n,) become at these positions (n,): a joint at its end goes no farther."""
        given = velocities_rad_s.copy()
        if self.lower_rad is not None:
            given[(positions_rad <= self.lower_rad + _AT_END_RAD) & (given < 0.0)] = 0.0
        if self.upper_rad is not None:
            given[(positions_rad >= self.upper_rad - _AT_END_RAD) & (given > 0.0)] = 0.0
        return given


@dataclass(frozen=True)
class Ability:
    """What the arm can do along one direction."""

    full_speed_m_s: float
    """v_max here: what full travel gives, once the joints' limits and the damping at a singularity are through."""
    acceleration_m_s2: float
    """a here: the least that the speed can change, with the joint that moves most at its limit."""
    within_reach: bool
    """Full travel moves the tool as it is meant to."""


def ability(pose: GripperPose, limits: JointLimits, direction: FloatArray, full_speed_m_s: float) -> Ability:
    """Resolve full travel along the unit vector `direction` (3,) into joint speeds, and see what they come to.

    full_speed_m_s: v_max as it is set.
    """
    twist = np.concatenate([full_speed_m_s * direction, np.zeros(3)])
    rates = joint_velocities(pose.tool_jacobian, twist, limits.velocity_rad_s)
    given = pose.tool_jacobian @ rates
    speed_m_s = max(float(given[:3] @ direction), _LEAST_SPEED_M_S)
    changing_s = max(float((np.abs(rates) / limits.acceleration_rad_s2).max()), _LEAST_RATE_RAD_S)
    return Ability(
        full_speed_m_s=speed_m_s,
        acceleration_m_s2=speed_m_s / changing_s,
        within_reach=bool(np.abs(given - twist).max() <= _MET * full_speed_m_s),
    )


def along_approach(pose: GripperPose, limits: JointLimits, full_speed_m_s: float) -> Ability:
    """The same along the tool's approach axis."""
    return ability(pose, limits, pose.tool_rotation[:, 2], full_speed_m_s)
