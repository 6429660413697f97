"""Parts of which a core is made."""

from collections.abc import Callable
from dataclasses import dataclass

from common.arrays import FloatArray
from common.timing.ages import LoopAge
from robot_side.arm.bounds import Bounds
from robot_side.arm.following import Following
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import Arm, GripperKinematics
from robot_side.arm.stick_frames import StickFrames
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.gripper.held_covers import HeldCovers
from robot_side.laws.law import Law
from robot_side.operators.operator_session import OperatorSession
from robot_side.outcome.figures import Observer
from robot_side.surroundings.perceived import ObjectSource, PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from robot_side.tick.explained import Overlapping


@dataclass(frozen=True, kw_only=True)
class RobotParts:
    """Parts of a core.

    To use another arm, camera or law, `replace` that part. Each set of parts serves only one core.
    """

    arm: Arm
    kinematics: GripperKinematics
    camera: ObjectSource
    law: Law
    surroundings: Surroundings
    session: OperatorSession
    loop_age: LoopAge
    limits: JointLimits
    motion: ToolMotionSettings
    following: Following | None = None
    """Judge of the arm's motion; None: one that tells joints by their numbers"""
    misplaced_m: Callable[[PerceivedObjects], float] = lambda _: 0.01
    """Distance by which a frame's things may be nearer than they are perceived, by the errors of camera and arm"""
    home_rad: FloatArray | None = None
    """(n,) joint positions of the start pose; None: there is no way home"""
    frames: StickFrames | None = None
    """Frames in which an operator may steer besides the tool's; None: as the tool's"""
    enlarged: Overlapping | None = None
    """Enlarged gripper, for the figures; None: what it shares with objects is unknown"""
    truth: Observer | None = None
    """Observer of true contacts and distances, for the figures; None if these are unknown"""
    held_covers: HeldCovers | None = None
    bounds: Bounds | None = None
    """Bounds of the tool's motion; None: none"""
    assists: bool = False
    """Whether to limit the speed along the triggers (see `speed_assist`)"""
    full_rate: bool = False
    """Whether to send a stiffness message in every tick"""
    seed: int = 0
    notes: tuple[str, ...] = ()
    """Notes about the scene for a person, shown before the run"""
