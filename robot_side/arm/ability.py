"""Find what the arm can do along a direction in one pose: its speed there, and how fast that changes."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import refuse, resolve
from robot_side.compiled.kernel import NUMBER, TRUTH, compiled, input_array, output_array
from robot_side.compiled.stack import on_stack

_MET = 1e-6
"""A tool that moves as asked but for this share is held back by nothing."""
_LEAST_SPEED_M_S = 1e-6
_LEAST_RATE_RAD_S = 1e-9
FOUND: Final = 3
"""`find_ability` finds this many numbers, then the joints' rates."""
_twist = on_stack(6)


@dataclass(frozen=True)
class JointLimits:
    """What the arm's own controller allows its joints, (n,) each; metres for a prismatic joint."""

    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
    lower_rad: FloatArray | None = None
    """Where each joint ends; None for one that nobody knows, or for none."""
    upper_rad: FloatArray | None = None

    @cached_property
    def ends_rad(self) -> tuple[FloatArray, FloatArray]:
        """`lower_rad` and `upper_rad`; infinite where there are none."""
        infinite = np.full(self.velocity_rad_s.size, np.inf)
        return (
            -infinite if self.lower_rad is None else np.ascontiguousarray(self.lower_rad),
            infinite if self.upper_rad is None else np.ascontiguousarray(self.upper_rad),
        )


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
    found = np.empty(FOUND + limits.velocity_rad_s.size)
    direction = np.ascontiguousarray(direction)
    usable = find_ability(
        *(pose.tool_jacobian, direction, full_speed_m_s, limits.velocity_rad_s, limits.acceleration_rad_s2, found)
    )
    if not usable:
        refuse(pose.tool_jacobian, full_speed_m_s * direction, limits.velocity_rad_s)
    speed_m_s, acceleration_m_s2, off_m_s = found[:FOUND].tolist()
    return Ability(speed_m_s, acceleration_m_s2, within_reach=off_m_s <= _MET * full_speed_m_s)


ABILITY: Final = (*(input_array(2), input_array(1), NUMBER, input_array(1), input_array(1), output_array(1)),)
"""Numba types of the arguments of `find_ability`, for a call by its address."""


@compiled(*ABILITY, returns=TRUTH)
def find_ability(
    jacobian: FloatArray,
    direction: FloatArray,
    full_speed: float,
    limits: FloatArray,
    accelerations: FloatArray,
    found: FloatArray,
) -> bool:
    """Fill `found` (3 + n,): speed, least acceleration, by how much the tool's motion differs at most, joints' rates.

    jacobian (6, n), direction (3,), limits and accelerations (n,). False where `resolve` can use none of them.
    """
    twist, rates = _twist(), found[FOUND:]
    for i in range(3):
        twist[i], twist[3 + i] = full_speed * direction[i], 0.0
    if not resolve(jacobian, twist, limits, rates):
        return False
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
    found[0], found[1], found[2] = speed, speed / changing, off
    return True


def along_approach(pose: GripperPose, limits: JointLimits, full_speed_m_s: float) -> Ability:
    """The same along the tool's approach axis."""
    return ability(pose, limits, pose.tool_rotation[:, 2], full_speed_m_s)


def change_times_s(pose: GripperPose, limits: JointLimits, twists: FloatArray) -> FloatArray:
    """Work out how long (n, 5) each joint takes from rest to full travel of R2, and to each fully deflected stick.

    K of a change Δ (5,) of travel and deflections, which takes max |K Δ|: the joint that changes most limits all.
    twists (5, 6): `tool_motion.full_twists`. ValueError as `joint_velocities`.
    """
    times_s = np.empty((len(twists), limits.velocity_rad_s.size))
    jacobian, rotation = np.ascontiguousarray(pose.tool_jacobian), np.ascontiguousarray(pose.tool_rotation)
    if not _find_change_times(jacobian, rotation, twists, limits.velocity_rad_s, limits.acceleration_rad_s2, times_s):
        refuse(pose.tool_jacobian, twists[0], limits.velocity_rad_s)
    return times_s.T


@compiled(*(input_array(2),) * 3, *(input_array(1),) * 2, output_array(2), returns=TRUTH)
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
