"""Rendering of the stiffness field as the strengths of both triggers and the drive of the motors.

field ─▶ strengths of each trigger's ten zones ─▶ smoothing: rise at once, fall over 100 ms ─▶ strengths to write
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
    HINDERED_DRIVE,
    MAX_STRENGTH,
    RELEASED,
    SENSED_TRAVEL,
    STANDS_DRIVE,
    ZONE_COUNT,
    Feel,
    Rumble,
    Strengths,
)
from operator_side.feel.commands_under_way import Displacement
from operator_side.feel.path_ahead import Asked, CourseOnMap, traced_zones
from operator_side.feel.zones import FREE, Zones, moving_along, zone_strengths, zone_travels
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel

FALL_S: Final = 0.1
"""Seconds in which a strength falls from 8 to 0; at a release it falls at once"""
Pulses = tuple[float, tuple[tuple[float, float], ...]]
STANDS: Final[Pulses] = (STANDS_DRIVE, ((0.0, 0.08),))
HINDERED: Final[Pulses] = (HINDERED_DRIVE, ((0.0, 0.06), (0.14, 0.2)))
"""Pulses of the right motor: drive, and begin and end of each pulse in seconds. The left motor alone signals danger;
both together signal blindness."""
_ROUNDING: Final = 1e-9
_TOUCHED: Final = MAX_STRENGTH // 2
"""Maximum strength in slow zones for an object that is meant to be touched"""


@dataclass(frozen=True)
class RenderingSettings(Limited):
    """Settings of the rendering from field to strengths."""

    horizon_s: Annotated[float, Meta(ge=0.0, le=2.0)] = HORIZON_S
    """Reaction h, in seconds: time for which a speed continues before anything felt can change it."""


class RenderedTrigger:
    """Strengths of one trigger's zones, smoothed over time."""

    def __init__(self, settings: RenderingSettings, travel: TriggerTravel) -> None:
        self.first_stiff: int | None = None
        """Lowest zone that ever had a strength above 0; None before the first."""
        self.max_strength = 0
        self.beyond_horizon = 0
        """Number of zones, summed over all renderings, that had full strength because D exceeded the horizon."""
        self._settings = settings
        self._travel = travel
        self.scale(1.0)
        self._levels = [0.0] * ZONE_COUNT
        self._last_s = -math.inf
        self._strengths = FREE_TRIGGER

    def scale(self, speed_scale: float) -> None:
        """Render for commands that are travel times `speed_scale` from now on."""
        self.travels = tuple(speed_scale * travel for travel in zone_travels(self._travel))
        """Calibrated travel at the middle of each zone, times the speed scale"""

    def render(
        self,
        field: TriggerField,
        horizon_m: float,
        other_travel: float,
        moving: Displacement,
        now_s: float,
        traced: Zones | None = None,
    ) -> Strengths:
        """Return the strengths at `now_s`: those of `traced_zones` if there are any, else by `zone_strengths`.

        The other arguments are those of `zone_strengths`.
        """
        zones = zone_strengths(field, horizon_m, self.travels, other_travel, moving, self._settings.horizon_s)
        if traced is not None:
            # A map has only the onset of full strength, so an object to be touched is felt straight ahead only.
            touched = field.slow_m[-1] > field.fast_m[-1]
            zones = traced.at_least(zones, _TOUCHED) if touched else traced
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
        """Set all strengths to 0 at once."""
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
        """Calibrated travel, 0 to 1, at which the first zone with a strength above 0 begins; 1 if there is none."""
        return self._travel.travel(min(self._strengths.count(0) / ZONE_COUNT / SENSED_TRAVEL, 1.0))


class TriggerRendering:
    """Rendering of both triggers and the motors.

    The left motor warns of objects where the sticks lead. The right one pulses when a held object is set down, and when
    the arm begins not to follow.
    """

    def __init__(
        self, settings: RenderingSettings, calibration: TravelCalibration, *, swap_sides: bool = False
    ) -> None:
        """swap_sides: render the robot side's L2 on the controller's R2, and its R2 on the controller's L2."""
        self.l2 = RenderedTrigger(settings, calibration.l2)
        self.r2 = RenderedTrigger(settings, calibration.r2)
        self._settings, self._swap_sides = settings, swap_sides
        self._traced: CourseOnMap | None = None
        self._zones: list[Zones] = []
        self._stands = self._hindered = False
        self._pulses, self._pulsed_s = STANDS, -math.inf
        self._scale = 1.0

    def scale(self, speed_scale: float) -> None:
        """Render for commands that are travel times `speed_scale` from now on."""
        self._scale, self._traced = speed_scale, None
        for trigger in (self.l2, self.r2):
            trigger.scale(speed_scale)

    def render(
        self,
        update: StiffnessUpdate | None,
        pulled: tuple[float, float],
        known: Displacement | None,
        now_s: float,
        aside: CourseOnMap | None = None,
    ) -> Feel:
        """Render both triggers and the motors at `now_s`; RELEASED, without a gradual fall, if `update` is None.

        pulled: present calibrated travel of the trigger that retreats, and of the one that advances. known: δ and w by
        our commands under way; None to use the robot side's. aside: course by the sticks on the map; None to render
        what is straight ahead.
        """
        if update is None:
            self.l2.release()
            self.r2.release()
            return RELEASED
        retreating, advancing = (self.r2, self.l2) if self._swap_sides else (self.l2, self.r2)
        back, forth = moving_along(update, known)
        behind, ahead = (self._scale * travel for travel in pulled)
        if aside is not None and aside is not self._traced:
            asked = (
                Asked(update.l2, retreating.travels, ahead, forth=False),
                Asked(update.r2, advancing.travels, behind, forth=True),
            )
            self._traced, self._zones = aside, traced_zones(aside, asked, self._settings.horizon_s)
        traced = (None, None) if aside is None else self._zones
        strengths = (
            retreating.render(update.l2, update.horizon_m, ahead, back, now_s, traced[0]),
            advancing.render(update.r2, update.horizon_m, behind, forth, now_s, traced[1]),
        )
        l2, r2 = reversed(strengths) if self._swap_sides else strengths
        if update.stands and not self._stands:
            self._pulses, self._pulsed_s = STANDS, now_s
        elif update.hindered and not self._hindered:
            self._pulses, self._pulsed_s = HINDERED, now_s
        self._stands, self._hindered = update.stands, update.hindered
        (drive, pulses_s), since_s = self._pulses, now_s - self._pulsed_s
        pulses = any(begin_s <= since_s < end_s for begin_s, end_s in pulses_s)
        return Feel(l2=l2, r2=r2, rumble=Rumble(update.rumble, drive if pulses else 0.0))

    def zones(self) -> dict[str, Any]:
        """Return, for each of the controller's triggers, its first stiff zone and its maximum strength in the run."""
        both = {"l2": self.l2, "r2": self.r2}
        return {name: {"first_stiff": one.first_stiff, "max": one.max_strength} for name, one in both.items()}

    def summary(self) -> dict[str, Any]:
        """Return `beyond_horizon` of each of the controller's triggers."""
        return {"l2": {"beyond_horizon": self.l2.beyond_horizon}, "r2": {"beyond_horizon": self.r2.beyond_horizon}}
