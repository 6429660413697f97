"""The bump in a trigger's travel where the gripper would touch: one zone stiffer than its profile.

The robot side says at which calibrated travel contact is predicted (`StiffnessUpdate.l2_contact`). A finger that
pulls runs into the bump there, may push through it, and so knows where contact begins.
"""

from functools import cache
from typing import Final

from operator_side.dualsense.effects.official import MAX_STRENGTH, ZONE_COUNT, MultiPositionFeedback, TriggerEffect

DETENT_STRENGTHS: Final = 2
"""How much stiffer than its profile the zone of contact is."""
_MARGIN_ZONES: Final = 0.2
"""The bump moves on once contact lies this far within another zone: noise at a border does not shake it."""


class DetentSelector:
    """Mechanical travel of contact to the zone that bears the bump, with hysteresis."""

    def __init__(self) -> None:
        self.zone: int | None = None

    def select(self, mechanical_travel: float | None) -> int | None:
        """The zone, 0 to 9, for contact at this travel, 0 to 1; None for none. ValueError for anything else."""
        if mechanical_travel is None:
            self.zone = None
            return None
        if not 0.0 <= mechanical_travel <= 1.0:
            raise ValueError(f"mechanical_travel = {mechanical_travel}; valid: 0 to 1, or None")
        exact = ZONE_COUNT * mechanical_travel
        if self.zone is None or not self.zone - _MARGIN_ZONES <= exact <= self.zone + 1 + _MARGIN_ZONES:
            self.zone = min(int(exact), ZONE_COUNT - 1)
        return self.zone


@cache
def with_detent(effect: TriggerEffect, zone: int | None) -> TriggerEffect:
    """`effect` with the bump in `zone`, at most at full strength there; `effect` itself for None."""
    if zone is None:
        return effect
    strengths = list(effect.zone_strengths)
    strengths[zone] = min(strengths[zone] + DETENT_STRENGTHS, MAX_STRENGTH)
    return MultiPositionFeedback(tuple(strengths))
