"""What nobody on the robot side can see; told by whoever runs the world, for a run's figures alone."""

from dataclasses import dataclass

from common.arrays import FloatArray


@dataclass(frozen=True)
class TargetTruth:
    """Where the target really is."""

    position_m: FloatArray
    """(3,) of its body"""
    support_gap_m: float
    """To the nearest support, negative inside it; at most 1 m"""
    sinking_m_s: float
    """Downwards"""
    tilt_rad: float
    """Between what was upwards at the start and upwards"""


@dataclass(frozen=True)
class Truth:
    """What nobody on the robot side can see: where the gripper really is among the objects."""

    min_distance_m: float | None
    """From the true, unenlarged gripper to the nearest object that is no support, negative inside it; None beyond
    the distance that was looked for."""
    min_obstacle_distance_m: float | None
    """The same over obstacles alone."""
    contacts: frozenset[tuple[str, str]]
    """(gripper geom, object) now in contact, supports included"""
    target: TargetTruth | None = None
    """None without a target"""
