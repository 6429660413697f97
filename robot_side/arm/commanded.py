"""Joint velocities that follow from a command, in one compiled call in a tick."""

import math

import numpy as np

from common.arrays import FloatArray, require_finite
from common.protocol.messages import MotionCommand
from robot_side.arm.ability import JointLimits
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import refuse, resolve
from robot_side.arm.tool_motion import ToolMotionSettings, tool_motion
from robot_side.compiled.kernel import BOOL, FLOAT64, compiled, input_array, output_array
from robot_side.compiled.stack import on_stack

_AT_END_RAD = 0.002
"""Distance from the end of its range, in rad, within which a joint counts as at the end: allows for encoder noise."""
_twist = on_stack(6)


def commanded(
    command: MotionCommand,
    pose: GripperPose,
    joint_positions_rad: FloatArray,
    limits: JointLimits,
    settings: ToolMotionSettings,
    *,
    stands: bool = False,
) -> tuple[FloatArray, float]:
    """Return joint velocities (n,) in rad/s by `joint_velocities`, and the tool's speed along the approach axis in m/s.

    The speed leaves out joints that are commanded beyond their ends. joint_positions_rad (n,). stands: whether a held
    object stands on something; there is then no motion downwards. ValueError for a pose that is not finite, as nothing
    may move by it.
    """
    linear, angular = tool_motion(command, settings)
    velocity = np.empty(joint_positions_rad.size)
    lower, upper = limits.ends_rad
    told_m_s = _command_loop(
        *(pose.tool_rotation, pose.tool_jacobian, joint_positions_rad, limits.velocity_rad_s, lower, upper),
        *linear,
        *angular,
        stands,
        velocity,
    )
    if math.isnan(told_m_s):
        if velocity.size != pose.tool_jacobian.shape[1]:
            raise ValueError(
                f"joint_positions_rad has the shape {joint_positions_rad.shape}; valid: {pose.tool_jacobian.shape[1:]}"
            )
        require_finite("tool_rotation", pose.tool_rotation)
        refuse(pose.tool_jacobian, np.array([*linear, *angular]), limits.velocity_rad_s)
    return velocity, told_m_s


@compiled(
    *(input_array(2), input_array(2), input_array(1), input_array(1), input_array(1), input_array(1)),
    *(FLOAT64, FLOAT64, FLOAT64, FLOAT64, FLOAT64, FLOAT64, BOOL, output_array(1)),
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
) -> float:
    """Fill `velocity` (n,); return the tool's speed along the approach axis, NaN for an unusable argument."""
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
        rate, position = velocity[joint], positions[joint]
        stays = (rate < 0.0 and position <= lower[joint] + _AT_END_RAD) or (
            rate > 0.0 and position >= upper[joint] - _AT_END_RAD
        )
        for row in range(0 if stays else 3):
            speed += rotation[row, 2] * jacobian[row, joint] * rate
    return speed
