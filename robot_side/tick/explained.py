"""Explanation of one trigger's field, for display: terms of the enlargement, and volume shared with each object."""

from typing import Literal, Protocol

from common.protocol.view_messages import EnlargementTerms
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

Trigger = Literal["l2", "r2"]
Overlaps = dict[int, float]
"""Volumes in m³ that the enlarged gripper shares with objects, keyed by the object's index; objects without are left
out. The gripper is the union of its spheres, inflated by D_σ and moved by the robot side's δ. Space counts once."""


class Explains(Protocol):
    """Interface of a law that can explain its result."""

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> EnlargementTerms:
        """Return the terms behind one trigger's field in `sensed`, which the law found for `situation`."""
        ...


class Overlapping(Protocol):
    """Interface of the enlarged gripper, which is the same under any law."""

    def overlaps_m3(self, trigger: Trigger, situation: Situation) -> Overlaps:
        """Return the volumes shared with objects, for the gripper enlarged along one trigger."""
        ...

    def overlap_m3(self, situation: Situation) -> float:
        """Return the volume shared with all objects, along the trigger that leads."""
        ...
