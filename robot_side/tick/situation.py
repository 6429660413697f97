"""Situation of one tick, as a law gets it."""

from dataclasses import dataclass

from common.arrays import FloatArray
from common.protocol.messages import Compensation, Vector2
from robot_side.arm.port import GripperPose
from robot_side.surroundings.perceived import PerceivedObjects


@dataclass
class Situation:
    """Gripper, objects and link in one tick."""

    pose: GripperPose
    """Pose of the gripper, with the spheres of the held object"""
    joint_velocities_rad_s: FloatArray
    """Measured rates of the joints (n,)"""
    objects: PerceivedObjects
    loop_age_s: float
    """t_d of eq. 8; the configured worst case while no loop age is known"""
    loop_age_known: bool
    """Whether the operator with the lease has echoed a stamp. Then commands under way are at most `loop_age_s` old."""
    loop_age_settled: bool
    """Whether `loop_age_s` comes from measurements alone; until then it contains the configured worst case"""
    compensation: Compensation
    """The side that compensates the delay; eq. 10 uses its prediction errors."""
    gap_m: float | None
    """Free gap between the fingers; None without a gripper"""
    held: int | None
    """Index of the held object, if any"""
    lateral: Vector2
    """Commanded deflection, right and up, of the stick that moves the tool across its approach axis"""
    astray_m_s: float = 0.0
    """Error of the tool's predicted velocity, while the arm does not follow (see `arm/following.py`)"""
    response_s: float = 0.0
    """Time from a command's arrival until the arm follows it, which `loop_age_s` contains (`JointLimits.response_s`)"""
    later_s: float = 0.0
    """Time by which the arm stops later than its limits say (see `arm/late_stops.py`)"""
