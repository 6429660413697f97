"""Speed and acceleration that the tool can reach along a direction in one pose, within the joints' limits."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from common.arrays import BoolArray, FloatArray
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import refuse, resolve
from robot_side.compiled.kernel import BOOL, FLOAT64, compiled, input_array, output_array, tuple_type
from robot_side.compiled.stack import on_stack

_MET = 1e-6
"""Largest deviation of the tool's motion from the commanded motion that counts as none, as a share of full speed"""
_LEAST_SPEED_M_S = 1e-6
_LEAST_RATE_RAD_S = 1e-9
_twist = on_stack(6)


@dataclass(frozen=True)
class JointLimits:
    """Limits of the joints in the arm's own controller, (n,) each; metres instead of radians for a prismatic joint."""

    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
    lower_rad: FloatArray | None = None
    """Lower end of each joint's range; None if all are unknown or without ends"""
    upper_rad: FloatArray | None = None

    slides: BoolArray | bool = False
    """Whether each joint slides"""

    @cached_property
    def ends_rad(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper ends of the joints' ranges; infinite if not given."""
        infinite = np.full(self.velocity_rad_s.size, np.inf)
        return (
            -infinite if self.lower_rad is None else np.ascontiguousarray(self.lower_rad),
            infinite if self.upper_rad is None else np.ascontiguousarray(self.upper_rad),
        )


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
    speed_m_s, acceleration_m_s2, off_m_s = _find_ability(
        *(pose.tool_jacobian, np.ascontiguousarray(direction), full_speed_m_s),
        *(limits.velocity_rad_s, limits.acceleration_rad_s2, np.empty(limits.velocity_rad_s.size)),
    )
    if not speed_m_s > 0.0:
        refuse(pose.tool_jacobian, full_speed_m_s * direction, limits.velocity_rad_s)
    return Ability(speed_m_s, acceleration_m_s2, within_reach=off_m_s <= _MET * full_speed_m_s)


@compiled(
    *(input_array(2), input_array(1), FLOAT64, *(input_array(1),) * 2, output_array(1)),
    returns=tuple_type(FLOAT64, FLOAT64, FLOAT64),
)
def _find_ability(
    jacobian: FloatArray,
    direction: FloatArray,
    full_speed: float,
    limits: FloatArray,
    accelerations: FloatArray,
    rates: FloatArray,
) -> tuple[float, float, float]:
    """Return the tool's speed, acceleration and largest deviation of its motion; the speed is 0 if `resolve` refuses.

    jacobian (6, n), direction (3,), limits and accelerations (n,). rates (n,): scratch, the joints'.
    """
    twist = _twist()
    for i in range(3):
        twist[i], twist[3 + i] = full_speed * direction[i], 0.0
    if not resolve(jacobian, twist, limits, rates):
        return 0.0, 0.0, 0.0
    speed, off, changing = 0.0, 0.0, _LEAST_RATE_RAD_S
    for row in range(6):
        given = 0.0
        for joint in range(rates.size):
            given += jacobian[row, joint] * rates[joint]
        speed += given * direction[row] if row < 3 else 0.0
        off = max(off, abs(given - twist[row]))
    for joint in range(rates.size):
        changing = max(changing, abs(rates[joint]) / accelerations[joint])
    speed = max(speed, _LEAST_SPEED_M_S)
    return speed, speed / changing, off


def along_approach(pose: GripperPose, limits: JointLimits, full_speed_m_s: float) -> Ability:
    """Return the ability along the tool's approach axis."""
    return ability(pose, limits, pose.tool_rotation[:, 2], full_speed_m_s)


def change_times_s(pose: GripperPose, limits: JointLimits, twists: FloatArray) -> FloatArray:
    """Return the times K (n, 5) from rest to full travel of R2 and to each full stick deflection, for each joint, in s.

    A change Δ (5,) of travel and stick deflections takes max |K Δ|: the joint that changes most limits all. twists (5,
    6): from `tool_motion.full_twists`. ValueError as for `joint_velocities`.
    """
    times_s = np.empty((len(twists), limits.velocity_rad_s.size))
    jacobian, rotation = np.ascontiguousarray(pose.tool_jacobian), np.ascontiguousarray(pose.tool_rotation)
    if not _find_change_times(jacobian, rotation, twists, limits.velocity_rad_s, limits.acceleration_rad_s2, times_s):
        refuse(pose.tool_jacobian, twists[0], limits.velocity_rad_s)
    return times_s.T


@compiled(*(input_array(2),) * 3, *(input_array(1),) * 2, output_array(2), returns=BOOL)
def _find_change_times(
    jacobian: FloatArray,
    rotation: FloatArray,
    twists: FloatArray,
    limits: FloatArray,
    accelerations: FloatArray,
    times: FloatArray,
) -> bool:
    for axis in range(twists.shape[0]):
        twist, rates = _twist(), times[axis]
        for i in range(6):
            row, part = i % 3, i - i % 3
            twist[i] = 0.0
            for k in range(3):
                twist[i] += rotation[row, k] * twists[axis, part + k]
        if not resolve(jacobian, twist, limits, rates):
            return False
        for joint in range(limits.size):
            rates[joint] /= accelerations[joint]
    return True
