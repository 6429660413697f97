"""From the field ahead to what both triggers and the motors do.

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
from operator_side.feel.path_ahead import Aside, traced_zones
from operator_side.feel.zones import FREE, moving_along, zone_strengths, zone_travels
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel

FALL_S: Final = 0.1
"""From full strength to none, unless the trigger is released."""
PULSE_S: Final = 0.08
_PULSE: Final = 0.7
"""Drive of the right motor alone: the left one says danger, and both say that the field is lost."""
_ROUNDING: Final = 1e-9
_TOUCHED: Final = MAX_STRENGTH // 2
"""The most that is felt, in slow zones, of what is to be touched"""


@dataclass(frozen=True)
class RenderingSettings(Limited):
    """How what lies ahead becomes what a finger feels."""

    horizon_s: Annotated[float, Meta(ge=0.0, le=2.0)] = HORIZON_S
    """h: so long a speed goes on before anything felt can change it (reaction, the finger's way, a write)."""


class RenderedTrigger:
    """One trigger's zones, and what they have to remember."""

    def __init__(self, settings: RenderingSettings, travel: TriggerTravel) -> None:
        self.first_stiff: int | None = None
        """The lowest zone that ever was stiff."""
        self.max_strength = 0
        self.beyond_horizon = 0
        """How many zones, over all renderings, were full because nobody knew what lay so far ahead."""
        self._settings = settings
        self._travel = travel
        self._travels = zone_travels(travel)
        self._levels = [0.0] * ZONE_COUNT
        self._last_s = -math.inf
        self._traced: Aside | None = None
        self._zones = FREE
        self._strengths = FREE_TRIGGER

    def render(
        self,
        field: TriggerField,
        horizon_m: float,
        other_travel: float,
        moving: Displacement,
        now_s: float,
        aside: Aside | None = None,
        *,
        forth: bool = True,
    ) -> Strengths:
        """The strengths at `now_s`; the others: of `zone_strengths`, or of `traced_zones` while sticks lead aside."""
        horizon_s = self._settings.horizon_s
        zones = zone_strengths(field, horizon_m, self._travels, other_travel, moving, horizon_s)
        if aside is not None:
            if aside is not self._traced:
                self._traced = aside
                self._zones = traced_zones(aside, field, self._travels, other_travel, horizon_s, forth=forth)
            # A map has ways of full strength alone: what is to be touched is felt straight ahead.
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
        """Let go at once."""
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
        """How far it is pulled, in calibrated travel, 0 to 1, by what the controller reports, before it stiffens."""
        return self._travel.travel(min(self._strengths.count(0) / ZONE_COUNT / SENSED_TRAVEL, 1.0))


class TriggerRendering:
    """Both triggers, and the motors for danger where the stick leads, and for what has come to stand."""

    def __init__(
        self, settings: RenderingSettings, calibration: TravelCalibration, *, swap_sides: bool = False
    ) -> None:
        """`swap_sides`: what the robot side says of L2 is for R2, and the other way round."""
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
        aside: Aside | None = None,
    ) -> Feel:
        """What both triggers and the motors have to do at `now_s`; all off, at once, for None.

        pulled: present calibrated travel of the trigger that retreats and of the one that advances. known: δ and w by
        our own commands under way; None where the robot side's are to be taken. aside: where our sticks lead, which is
        felt in their stead.
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
        """The run's figures of the controller's own triggers."""
        both = {"l2": self.l2, "r2": self.r2}
        return {name: {"first_stiff": one.first_stiff, "max": one.max_strength} for name, one in both.items()}

    def summary(self) -> dict[str, Any]:
        """What else is to be known of the run."""
        return {"l2": {"beyond_horizon": self.l2.beyond_horizon}, "r2": {"beyond_horizon": self.r2.beyond_horizon}}
