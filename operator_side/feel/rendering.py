"""Rendering of the field: both triggers' strengths and the motors' drive.

field ─▶ ten zones of each trigger ─▶ falls over 100 ms, rises at once ─▶ strengths
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any, Final

from msgspec import Meta

from common.limits import Limited
from common.protocol.messages import StiffnessUpdate, TriggerField
from common.reaction import HORIZON_S
from operator_side.controller.feel import (
    FREE_TRIGGER,
    MAX_STRENGTH,
    RELEASED,
    SENSED_TRAVEL,
    ZONE_COUNT,
    Feel,
    Rumble,
    Strengths,
)
from operator_side.feel.commands_under_way import Displacement
from operator_side.feel.path_ahead import CourseOnMap, traced_zones
from operator_side.feel.zones import FREE, moving_along, zone_strengths, zone_travels
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel

FALL_S: Final = 0.1
"""Fall from full strength to none, in seconds, unless the trigger is released."""
PULSE_S: Final = 0.08
_PULSE: Final = 0.7
"""Drive of the right motor alone: the left one signals danger, and both signal a lost field."""
_ROUNDING: Final = 1e-9
_TOUCHED: Final = MAX_STRENGTH // 2
"""Largest strength, in slow zones, of an object that is to be touched"""


@dataclass(frozen=True)
class RenderingSettings(Limited):
    """Settings of the rendering from field to strengths."""

    horizon_s: Annotated[float, Meta(ge=0.0, le=2.0)] = HORIZON_S
    """h: time for which a speed continues before anything felt can change it (reaction, finger's travel, write)."""


class RenderedTrigger:
    """Zones of one trigger, with their state over time."""

    def __init__(self, settings: RenderingSettings, travel: TriggerTravel) -> None:
        self.first_stiff: int | None = None
        """Lowest zone that ever was stiff."""
        self.max_strength = 0
        self.beyond_horizon = 0
        """Number of zones, over all renderings, that were full because D exceeded the horizon."""
        self._settings = settings
        self._travel = travel
        self._travels = zone_travels(travel)
        self._levels = [0.0] * ZONE_COUNT
        self._last_s = -math.inf
        self._traced: CourseOnMap | None = None
        self._zones = FREE
        self._strengths = FREE_TRIGGER

    def render(
        self,
        field: TriggerField,
        horizon_m: float,
        other_travel: float,
        moving: Displacement,
        now_s: float,
        aside: CourseOnMap | None = None,
        *,
        forth: bool = True,
    ) -> Strengths:
        """Render at `now_s`; for the others see `zone_strengths`, or `traced_zones` while the sticks are deflected."""
        horizon_s = self._settings.horizon_s
        zones = zone_strengths(field, horizon_m, self._travels, other_travel, moving, horizon_s)
        if aside is not None:
            if aside is not self._traced:
                self._traced = aside
                self._zones = traced_zones(aside, field, self._travels, other_travel, horizon_s, forth=forth)
            # A map has only the onset of full strength: objects to be touched are felt straight ahead.
            touched = field.slow_m[-1] > field.fast_m[-1]
            zones = self._zones.at_least(zones, _TOUCHED) if touched else self._zones
        self.beyond_horizon += zones.beyond_horizon
        if zones is FREE and not any(self._levels):
            self._last_s = now_s
            return self._strengths
        fallen = MAX_STRENGTH * max(now_s - self._last_s, 0.0) / FALL_S
        self._last_s = now_s
        self._levels = [
            max(float(strength), level - fallen) for strength, level in zip(zones.strengths, self._levels, strict=True)
        ]
        self._show(tuple(math.ceil(level - _ROUNDING) for level in self._levels))
        return self._strengths

    def release(self) -> None:
        """Drop all strengths at once."""
        self._levels = [0.0] * ZONE_COUNT
        self._show(FREE_TRIGGER)

    def _show(self, strengths: Strengths) -> None:
        if strengths == self._strengths:
            return
        self._strengths = strengths
        self.max_strength = max(self.max_strength, strengths[-1])
        free = strengths.count(0)
        if free < ZONE_COUNT and (self.first_stiff is None or free < self.first_stiff):
            self.first_stiff = free

    @property
    def free_travel(self) -> float:
        """Calibrated travel, 0 to 1, at which it stiffens, as the controller reports travel."""
        return self._travel.travel(min(self._strengths.count(0) / ZONE_COUNT / SENSED_TRAVEL, 1.0))


class TriggerRendering:
    """Rendering of both triggers, and of the motors for danger where the stick leads and for an object set down."""

    def __init__(
        self, settings: RenderingSettings, calibration: TravelCalibration, *, swap_sides: bool = False
    ) -> None:
        """swap_sides: the robot side's L2 is rendered on R2, and its R2 on L2."""
        self.l2 = RenderedTrigger(settings, calibration.l2)
        self.r2 = RenderedTrigger(settings, calibration.r2)
        self._swap_sides = swap_sides
        self._stands = False
        self._pulse_ends_s = -math.inf

    def render(
        self,
        felt: StiffnessUpdate | None,
        pulled: tuple[float, float],
        known: Displacement | None,
        now_s: float,
        aside: CourseOnMap | None = None,
    ) -> Feel:
        """Render both triggers and the motors at `now_s`; RELEASED at once for None.

        pulled: present calibrated travel of the trigger that retreats and of the one that advances. known: δ and w by
        our commands under way; None for the robot side's. aside: the sticks' course, rendered instead of the zones
        straight ahead.
        """
        if felt is None:
            self.l2.release()
            self.r2.release()
            return RELEASED
        retreating, advancing = (self.r2, self.l2) if self._swap_sides else (self.l2, self.r2)
        back, forth = moving_along(felt, known)
        strengths = (
            retreating.render(felt.l2, felt.horizon_m, pulled[1], back, now_s, aside, forth=False),
            advancing.render(felt.r2, felt.horizon_m, pulled[0], forth, now_s, aside),
        )
        l2, r2 = reversed(strengths) if self._swap_sides else strengths
        if felt.stands and not self._stands:
            self._pulse_ends_s = now_s + PULSE_S
        self._stands = felt.stands
        return Feel(l2=l2, r2=r2, rumble=Rumble(felt.rumble, _PULSE if now_s < self._pulse_ends_s else 0.0))

    def zones(self) -> dict[str, Any]:
        """Return the run's figures of the controller's own triggers."""
        both = {"l2": self.l2, "r2": self.r2}
        return {name: {"first_stiff": one.first_stiff, "max": one.max_strength} for name, one in both.items()}

    def summary(self) -> dict[str, Any]:
        """Return the other figures of the run."""
        return {"l2": {"beyond_horizon": self.l2.beyond_horizon}, "r2": {"beyond_horizon": self.r2.beyond_horizon}}
