"""Interface of every law: from a situation to two trigger fields and a rumble, once a tick."""

from dataclasses import dataclass
from typing import Protocol

from common.arrays import FloatArray
from common.protocol.around import Around
from common.protocol.messages import Compensation, Vector2
from robot_side.arm.port import GripperPose
from robot_side.laws.sensed import Sensed
from robot_side.surroundings.perceived import PerceivedObjects


@dataclass
class Situation:
    """Gripper, objects and link in one tick."""

    pose: GripperPose
    """Pose of the gripper, with the spheres of the held object"""
    joint_velocities_rad_s: FloatArray
    """(n,)"""
    objects: PerceivedObjects
    loop_age_s: float
    """t_d of eq. 8; the configured worst case while unknown"""
    loop_age_known: bool
    """Whether the owner has echoed a stamp. Then commands under way are at most `loop_age_s` old."""
    loop_age_settled: bool
    """Whether `loop_age_s` no longer contains anything of the worst case; else a distance made of it is no figure."""
    compensation: Compensation
    """The side that compensates the delay; eq. 10 uses its prediction errors."""
    gap_m: float | None
    """Free gap between the fingers; None without a gripper"""
    held: int | None
    """Index of the held object, if any"""
    lateral: Vector2
    """Deflection of the stick that moves across, as commanded"""


class Law(Protocol):
    """Law from a situation to stiffness."""

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Compute one tick."""
        ...

    def around(self, pose: GripperPose) -> Around | None:
        """Return the map of onset distances around the gripper, for an operator side that traces its path, or None."""
        ...

    def summary(self) -> dict[str, int]:
        """Return counts of the work, done and saved, over the run."""
        ...
