"""Ground truth from the simulation, only for the figures of a run; the robot side's control never uses it."""

from dataclasses import dataclass

from common.arrays import FloatArray
from common.roles import Role


@dataclass(frozen=True)
class TargetTruth:
    """True pose and motion of the target."""

    position_m: FloatArray
    """(3,) position of the target's body, in the world frame"""
    support_gap_m: float
    """Distance from the target to the nearest support, negative inside a support; at most 1 m"""
    sinking_m_s: float
    """Speed of the target downwards"""
    tilt_rad: float
    """Angle between the vertical and the direction of the target's body that pointed upwards at the start"""


@dataclass(frozen=True)
class Truth:
    """True distances and contacts of the gripper."""

    min_distance_m: float | None
    """Distance from the true gripper, not enlarged, to the nearest object that is no support, negative inside the
    object; None beyond the observer's range."""
    min_obstacle_distance_m: float | None
    """Distance from the true gripper to the nearest obstacle, negative inside it; None beyond the observer's range"""
    contacts: frozenset[tuple[str, str]]
    """Pairs (geom of the gripper, object) that are in contact now, supports included"""
    target: TargetTruth | None = None
    """True pose and motion of the target; None without a target"""


@dataclass(frozen=True)
class ContactOnset:
    """Beginning of a contact."""

    thing: str
    """Name of the object that is touched"""
    gripper_part: str
    """Name of the geom, of the gripper or of the held object, that touches it"""
    closing_speed_m_s: float
    """Closing speed of the touching points along the contact's normal, before the physics step that
    found the contact"""
    by_held: bool
    """Whether that geom is of the held object"""


def is_hit(role: Role, *, by_held: bool) -> bool:
    """Return whether a contact with an object of this role is a hit. by_held: what is held touches, not the gripper.

    The target is to be touched, and a held object that touches a support is being set down.
    """
    return role is not Role.TARGET and not (by_held and role is Role.SUPPORT)
