"""Calibration of one controller: raw travel and stick positions to calibrated travel and deflections."""

import math
from dataclasses import dataclass, field
from typing import Final

from operator_side.controller.feel import SENSED_TRAVEL, ZONE_COUNT
from operator_side.controller.state import Stick

LARGEST_REST: Final = 0.3
"""Maximum distance of a stick's rest position from its centre; farther away the stick is broken, or held"""
LEAST_SPAN: Final = 0.2
"""Minimum raw travel between released and fully pulled; with less, a few counts of the sensor would be full speed"""
_ROUNDING: Final = 1e-9
_LEAST_MEANT: Final = 1e-3
"""Deflection below which a stick counts as at rest"""


@dataclass(frozen=True)
class TriggerTravel:
    """Part of one trigger's raw travel that is used: from dead zone to saturation."""

    dead_zone: float = 0.05
    """Raw travel up to which a trigger is released."""
    saturation: float = 0.98
    """Raw travel from which a trigger is fully pulled."""

    def __post_init__(self) -> None:
        # The second comparison is false for NaN, too.
        if not (self.dead_zone >= 0.0 and self.dead_zone + LEAST_SPAN <= self.saturation <= 1.0):
            raise ValueError(
                f"dead_zone = {self.dead_zone}, saturation = {self.saturation}; valid: 0 <= dead_zone, at least"
                f" {LEAST_SPAN} below saturation, <= 1"
            )

    def travel(self, raw: float) -> float:
        """Return the calibrated travel, 0 to 1; exactly 0 within the dead zone."""
        return min(max((raw - self.dead_zone) / (self.saturation - self.dead_zone), 0.0), 1.0)

    def raw(self, travel: float) -> float:
        """Return the raw travel that gives the calibrated `travel`, 0 to 1; for 0, the end of the dead zone."""
        return min(self.dead_zone + travel * (self.saturation - self.dead_zone), self.saturation)

    @property
    def reachable_zones(self) -> int:
        """Number of the ten zones that a full pull of the trigger enters; zones beyond are never felt."""
        return max(1, math.ceil(ZONE_COUNT * SENSED_TRAVEL * self.saturation - _ROUNDING))


@dataclass(frozen=True)
class StickRest:
    """Rest position and dead zone of one stick."""

    x: float = 0.0
    """Rest position, right positive; worn sticks do not return to the centre."""
    y: float = 0.0
    """Rest position, up positive."""
    dead_zone: float = 0.1
    """Radius around the rest position within which the stick is at rest."""

    def __post_init__(self) -> None:
        if not math.hypot(self.x, self.y) <= LARGEST_REST:  # false for NaN, too
            raise ValueError(f"x = {self.x}, y = {self.y}; valid: within {LARGEST_REST} of the centre")
        if not 0.0 <= self.dead_zone < 1.0 - math.hypot(self.x, self.y):
            raise ValueError(f"dead_zone = {self.dead_zone}; valid: 0 to below 1 minus the distance of its rest")

    def deflection(self, raw: Stick) -> Stick:
        """Return the deflection from rest: 0 in the dead zone, then growing to length 1 in every direction."""
        x, y = raw[0] - self.x, raw[1] - self.y
        radius = math.hypot(x, y)
        if radius <= self.dead_zone:
            return 0.0, 0.0
        # The shortest span, on the side to which the stick rests; on the other side it saturates early.
        span = 1.0 - math.hypot(self.x, self.y) - self.dead_zone
        scale = min((radius - self.dead_zone) / span, 1.0) / radius
        # Rounding must not leave the range.
        return min(max(x * scale, -1.0), 1.0), min(max(y * scale, -1.0), 1.0)

    def raw(self, deflection: Stick) -> Stick:
        """Return the raw position, of length at most 1, that gives `deflection` for a stick that rests at (0, 0)."""
        radius = math.hypot(*deflection)
        if radius < _LEAST_MEANT:
            return 0.0, 0.0
        scale = min(self.dead_zone + (1.0 - self.dead_zone) * radius, 1.0) / radius
        return deflection[0] * scale, deflection[1] * scale


@dataclass(frozen=True)
class TravelCalibration:
    """Calibration of one controller's triggers and sticks, named as on the controller, before sides are swapped."""

    l2: TriggerTravel = field(default_factory=TriggerTravel)
    r2: TriggerTravel = field(default_factory=TriggerTravel)
    left_stick: StickRest = field(default_factory=StickRest)
    right_stick: StickRest = field(default_factory=StickRest)


IDENTITY: Final = TravelCalibration(
    TriggerTravel(0.0, 1.0), TriggerTravel(0.0, 1.0), StickRest(dead_zone=0.0), StickRest(dead_zone=0.0)
)
"""Calibration that changes nothing: raw travel is calibrated travel."""
