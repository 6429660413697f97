"""What a law makes of the surroundings in one tick: two trigger fields and a rumble, whatever the law."""

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
    """Where the gripper is among what, and what is known of the link."""

    pose: GripperPose
    """With the spheres of what it holds"""
    joint_velocities_rad_s: FloatArray
    """(n,)"""
    objects: PerceivedObjects
    loop_age_s: float
    """t_d of eq. 8; the configured worst case while unknown"""
    loop_age_known: bool
    """Whether the owner has echoed a stamp, so that what is under way is no older than `loop_age_s`."""
    compensation: Compensation
    """Whose prediction of the delay's displacement is felt."""
    gap_m: float | None
    """Free gap between the fingers; None without a gripper"""
    held: int | None
    """The object that the gripper holds"""
    lateral: Vector2
    """Deflection of the stick that moves across, as commanded"""


class Law(Protocol):
    """From a situation to what is felt."""

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick."""
        ...

    def around(self, pose: GripperPose) -> Around | None:
        """Ways from around the gripper, for an operator side that traces its sticks; None for none."""
        ...

    def summary(self) -> dict[str, int]:
        """How much work there was and was not, over the run."""
        ...
