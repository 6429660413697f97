"""Joint velocities that follow from a command, in one compiled call in a tick."""

import math
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, require_finite
from common.protocol.messages import MotionCommand
from robot_side.arm.ability import JointLimits
from robot_side.arm.hindrance import Cause
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import is_damped, refuse, resolve
from robot_side.arm.tool_motion import ToolMotionSettings, tool_motion
from robot_side.compiled.kernel import BOOL, FLOAT64, building_block, compiled, inlined, input_array, output_array
from robot_side.compiled.stack import on_stack

_AT_END_RAD = 0.002
"""Distance from the end of its range, in rad, within which a joint counts as at the end: allows for encoder noise."""
LEVER_M: Final = 0.2
"""Distance from the tool's point at which a turn counts as a speed, in m: about a gripper's length"""
_LEAST: Final = 0.01
"""Share of the command that is left undone up to which no cause is looked for"""
_FULL: Final = 1.0 - 1e-9
_END, _SINGULAR, _SPEED, _JOINTS = (float(one) for one in Cause)
_twist, _given, _stopped = on_stack(6), on_stack(6), on_stack(6)


class Commanded(NamedTuple):
    """Joint velocities for a command, and how far they follow the command."""

    velocity_rad_s: FloatArray
    """(n,)"""
    commanded_m_s: float
    """Tool's speed along the approach axis"""
    undone: float
    """Share of the commanded motion that the tool will not make, 0 to 1"""
    cause: Cause | None
    """Main cause of it; None if next to nothing is left undone"""
    joint: int
    """Number of the joint that is the cause, from 1 on; 0 if it is not one joint"""


def commanded(
    command: MotionCommand,
    pose: GripperPose,
    joint_positions_rad: FloatArray,
    limits: JointLimits,
    settings: ToolMotionSettings,
    *,
    stands: bool = False,
) -> Commanded:
    """Return the joint velocities by `joint_velocities`, and the tool's motion that follows from them.

    The tool's motion leaves out joints that are commanded beyond their ends. joint_positions_rad (n,). stands: whether
    a held object stands on something; there is then no motion downwards. ValueError for a pose that is not finite, as
    nothing may move by it.
    """
    linear, angular = tool_motion(command, settings)
    velocity, missed = np.empty(joint_positions_rad.size), np.zeros(3)
    lower, upper = limits.ends_rad
    commanded_m_s = _command_loop(
        *(pose.tool_rotation, pose.tool_jacobian, joint_positions_rad, limits.velocity_rad_s, lower, upper),
        *linear,
        *angular,
        stands,
        velocity,
        missed,
    )
    if math.isnan(commanded_m_s):
        if velocity.size != pose.tool_jacobian.shape[1]:
            raise ValueError(
                f"joint_positions_rad has the shape {joint_positions_rad.shape}; valid: {pose.tool_jacobian.shape[1:]}"
            )
        require_finite("tool_rotation", pose.tool_rotation)
        refuse(pose.tool_jacobian, np.array([*linear, *angular]), limits.velocity_rad_s)
    undone, cause, joint = missed.tolist()
    return Commanded(velocity, commanded_m_s, undone, Cause(int(cause)) if cause else None, int(joint))


@inlined
def _stays(rate: float, position: float, lower: float, upper: float) -> bool:
    """Return whether a joint at the end of its range is commanded beyond it."""
    return (rate < 0.0 and position <= lower + _AT_END_RAD) or (rate > 0.0 and position >= upper - _AT_END_RAD)


@building_block
def _find_missed(
    jacobian: FloatArray,
    twist: FloatArray,
    velocity: FloatArray,
    positions: FloatArray,
    limits: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    missed: FloatArray,
) -> None:
    """Fill `missed` (3,): the share of `twist` left undone, its cause, and the joint; 0 for none."""
    most, fastest, at_end, at_limit = 0.0, 0.0, 0, 0
    given, stopped = _given(), _stopped()
    for row in range(6):
        given[row] = stopped[row] = 0.0
    for joint in range(velocity.size):
        rate, part = velocity[joint], 0.0
        stays = _stays(rate, positions[joint], lower[joint], upper[joint])
        if abs(rate) > fastest * limits[joint]:
            fastest, at_limit = abs(rate) / limits[joint], joint + 1
        for row in range(6):
            one = (1.0 if row < 3 else LEVER_M) * jacobian[row, joint] * rate
            given[row] += one
            stopped[row] += one if stays else 0.0
            part += one * one
        if stays and part > most:
            most, at_end = part, joint + 1
    asked, by_ends, by_rates, undone = 0.0, 0.0, 0.0, 0.0
    for row in range(6):
        wanted = (1.0 if row < 3 else LEVER_M) * twist[row]
        asked += wanted * wanted
        by_ends += stopped[row] * stopped[row]
        by_rates += (wanted - given[row]) ** 2
        undone += (wanted - given[row] + stopped[row]) ** 2
    if undone <= _LEAST * _LEAST * asked:
        return
    missed[0] = min(math.sqrt(undone / asked), 1.0)
    if by_ends >= by_rates:
        missed[1], missed[2] = _END, at_end
    elif is_damped(jacobian):
        missed[1] = _SINGULAR
    elif fastest >= _FULL:
        missed[1], missed[2] = _SPEED, at_limit
    else:
        missed[1] = _JOINTS


@compiled(
    *(input_array(2), input_array(2), input_array(1), input_array(1), input_array(1), input_array(1)),
    *(FLOAT64, FLOAT64, FLOAT64, FLOAT64, FLOAT64, FLOAT64, BOOL, output_array(1), output_array(1)),
    returns=FLOAT64,
)
def _command_loop(
    rotation: FloatArray,
    jacobian: FloatArray,
    positions: FloatArray,
    limits: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    right: float,
    down: float,
    ahead: float,
    about_right: float,
    about_down: float,
    about_ahead: float,
    stands: bool,
    velocity: FloatArray,
    missed: FloatArray,
) -> float:
    """Fill `velocity` (n,) and `missed` (3,): share left undone, cause, and joint, 0 for none.

    Return the tool's speed along the approach axis, NaN for an unusable argument.
    """
    if not jacobian.shape[1] == positions.size == limits.size == lower.size == upper.size:
        return math.nan
    twist = _twist()
    for row in range(3):
        x, y, z = rotation[row, 0], rotation[row, 1], rotation[row, 2]
        twist[row] = x * right + y * down + z * ahead
        twist[3 + row] = x * about_right + y * about_down + z * about_ahead
    if stands and twist[2] < 0.0:  # NaN stays
        twist[2] = 0.0
    if not resolve(jacobian, twist, limits, velocity):
        return math.nan
    speed = 0.0
    for joint in range(velocity.size):
        rate = velocity[joint]
        for row in range(0 if _stays(rate, positions[joint], lower[joint], upper[joint]) else 3):
            speed += rotation[row, 2] * jacobian[row, joint] * rate
    _find_missed(jacobian, twist, velocity, positions, limits, lower, upper, missed)
    return speed
