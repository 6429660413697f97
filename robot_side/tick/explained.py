"""Explanation of one trigger's field, for display: terms of the enlargement, and overlap with each object."""

from dataclasses import dataclass
from typing import Literal, Protocol

from common.protocol.view_messages import EnlargementTerms
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

Trigger = Literal["l2", "r2"]
Overlaps = dict[int, float]
"""Overlap in m³, keyed by the object's index; objects without overlap are left out"""


@dataclass(frozen=True)
class TriggerExplained:
    """Enlargement and overlaps along one trigger."""

    terms: EnlargementTerms
    overlaps_m3: Overlaps
    """Overlaps (eq. 11-12) of the enlarged gripper. swept: inflated by D_σ and moved by the robot side's δ. paper:
    inflated by D_incr and not moved."""


class Explains(Protocol):
    """Interface of a law that can explain its result."""

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> TriggerExplained:
        """Return the terms and overlaps behind one trigger's field in `sensed`, which the law found for `situation`."""
        ...
