"""Ground truth from the simulation, for a run's figures alone; the robot side itself never uses it."""

from dataclasses import dataclass

from common.arrays import FloatArray


@dataclass(frozen=True)
class TargetTruth:
    """True pose and motion of the target."""

    position_m: FloatArray
    """(3,) position of the target's body, in the world frame"""
    support_gap_m: float
    """Distance to the nearest support, negative inside it; at most 1 m"""
    sinking_m_s: float
    """Speed downwards"""
    tilt_rad: float
    """Angle between its direction that was upwards at the start and upwards"""


@dataclass(frozen=True)
class Truth:
    """True distances and contacts of the gripper."""

    min_distance_m: float | None
    """Distance from the true, unenlarged gripper to the nearest object that is no support, negative inside it; None
    beyond the observer's range."""
    min_obstacle_distance_m: float | None
    """Distance to the nearest obstacle, likewise"""
    contacts: frozenset[tuple[str, str]]
    """(gripper geom, object) pairs now in contact, supports included"""
    target: TargetTruth | None = None
    """Truth of the target; None without one"""
