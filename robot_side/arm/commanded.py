"""Joint velocities that follow from a command."""

import math
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, require_finite
from common.protocol.messages import MotionCommand
from robot_side.arm.bounds import Bounds
from robot_side.arm.hindrance import Cause
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import is_damped, joint_velocities
from robot_side.arm.tool_motion import ToolMotionSettings, tool_motion

_AT_END_RAD = 0.002
"""Distance from the end of its range, in rad, within which a joint counts as at the end: allows for encoder noise."""
LEVER_M: Final = 0.2
"""Distance from the tool's point at which a turn counts as a speed, in m: about a gripper's length"""
_LEAST: Final = 0.01
"""Share of the command that is left undone up to which no cause is looked for"""
_FULL: Final = 1.0 - 1e-9
_WEIGHTS: Final = np.array([[1.0], [1.0], [1.0], [LEVER_M], [LEVER_M], [LEVER_M]])


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
    bounds: Bounds | None = None,
) -> Commanded:
    """Return the joint velocities by `joint_velocities`, and the tool's motion that follows from them.

    The tool's motion leaves out joints that are commanded beyond their ends. joint_positions_rad (n,). stands: whether
    a held object stands on something; there is then no motion downwards. bounds: of the tool's motion. ValueError for a
    pose that is not finite, as nothing may move by it.
    """
    linear, angular = tool_motion(command, settings)
    if joint_positions_rad.size != pose.tool_jacobian.shape[1]:
        raise ValueError(
            f"joint_positions_rad has the shape {joint_positions_rad.shape}; valid: {pose.tool_jacobian.shape[1:]}"
        )
    require_finite("tool_rotation", pose.tool_rotation)
    twist: FloatArray = (np.array([linear, angular]) @ pose.tool_rotation.T).ravel()
    if stands:
        twist[2] = max(twist[2], 0.0)
    asked_m_s, bounded = twist[:3].copy(), False
    if bounds is not None:
        twist[:3] = bounds.kept(asked_m_s, pose.tool_position_m, limits)
        bounded = not np.allclose(twist[:3], asked_m_s)
    velocity = joint_velocities(pose.tool_jacobian, twist, limits.velocity_rad_s)
    if bounds is not None:  # an arm of few joints moves otherwise than asked
        share = bounds.share(pose.tool_jacobian[:3] @ velocity, pose.tool_position_m, limits)
        velocity, bounded = share * velocity, bounded or share < 1.0 - _LEAST
    lower, upper = limits.ends_rad
    stays = ((velocity < 0.0) & (joint_positions_rad <= lower + _AT_END_RAD)) | (
        (velocity > 0.0) & (joint_positions_rad >= upper - _AT_END_RAD)
    )
    parts = _WEIGHTS * pose.tool_jacobian * velocity
    stopped: FloatArray = parts @ stays
    twist[:3] = asked_m_s
    left = _WEIGHTS[:, 0] * twist - parts.sum(axis=1)
    commanded_m_s = float(pose.tool_rotation[:, 2] @ (parts @ ~stays)[:3])
    asked, undone = _WEIGHTS[:, 0] * twist, left + stopped
    asked_2, undone_2 = float(asked @ asked), float(undone @ undone)
    if undone_2 <= _LEAST * _LEAST * asked_2:
        return Commanded(velocity, commanded_m_s, 0.0, None, 0)
    if bounded:
        return Commanded(velocity, commanded_m_s, min(math.sqrt(undone_2 / asked_2), 1.0), Cause.BOUNDS, 0)
    cause, joint = Cause.JOINTS, 0
    shares = np.abs(velocity) / limits.velocity_rad_s
    if float(stopped @ stopped) >= float(left @ left):
        cause, joint = Cause.END, 1 + int(np.where(stays, (parts * parts).sum(axis=0), -1.0).argmax())
    elif is_damped(pose.tool_jacobian):
        cause = Cause.SINGULARITY
    elif shares.max() >= _FULL:
        cause, joint = Cause.SPEED, 1 + int(shares.argmax())
    return Commanded(velocity, commanded_m_s, min(math.sqrt(undone_2 / asked_2), 1.0), cause, joint)
