"""What both triggers and the motors have to feel like now: stiffness, contact and time to effects.

stiffness ─▶ band ─▶ level ─▶ limit on sustained force ─▶ profile ─▶ detent at contact ─▶ effect
"""

from dataclasses import dataclass, field
from typing import Any

from common.protocol.messages import StiffnessUpdate
from operator_side.dualsense.effects.official import ZONE_COUNT, TriggerEffect
from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL
from operator_side.dualsense.reports.output_report import OutputReport, Rumble
from operator_side.feel.bands import Band, BandSettings
from operator_side.feel.contact_detent import DetentSelector, with_detent
from operator_side.feel.force_profiles import force_profiles
from operator_side.feel.level import LevelSelector
from operator_side.feel.sustained_force import SustainedForceLimit, SustainedForceSettings
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel

_RUMBLE_STEPS = 8
"""Coarse steps: a motor needs no more, and each is a write."""


@dataclass(frozen=True)
class RenderingSettings:
    """How stiffness becomes what a finger feels."""

    bands: BandSettings = field(default_factory=BandSettings)
    sustained: SustainedForceSettings = field(default_factory=SustainedForceSettings)
    detent: bool = True
    """A bump in the travel where the gripper would touch."""

    def __post_init__(self) -> None:
        if not self.bands.marked:
            return
        lowered = ZONE_COUNT * self.sustained.sustainable_strength
        near = self.bands.exact_level(self.bands.danger, Band.NEAR)
        if lowered <= near:
            raise ValueError(
                f"sustained.sustainable_strength = {self.sustained.sustainable_strength} with bands.danger ="
                f" {self.bands.danger}; valid: above {near / ZONE_COUNT:g}, lest lasting danger feel weaker than near"
            )


class RenderedTrigger:
    """One trigger's way from stiffness to effect, and what it has to remember."""

    def __init__(self, settings: RenderingSettings, travel: TriggerTravel) -> None:
        self.profiles = force_profiles(travel.reachable_zones)
        self.band_changes = 0
        self.limited_s = 0.0
        """How long its force has been lowered because it had lasted."""
        self._settings = settings
        self._travel = travel
        self._levels = LevelSelector(settings.bands)
        self._limit = SustainedForceLimit(settings.sustained)
        self._detent = DetentSelector()
        self._limited = False
        self._last_s: float | None = None

    @property
    def band(self) -> Band:
        """The band in force."""
        return self._levels.band

    @property
    def limited(self) -> bool:
        """Whether its force is lowered now, because it has lasted."""
        return self._limited

    def render(self, stiffness: float, contact: float | None, now_s: float) -> TriggerEffect:
        """The effect for `stiffness`, 0 to 1, with contact predicted at the calibrated travel `contact`, or none.

        At one `now_s` and `contact` no zone's strength falls as the stiffness grows. ValueError for what is out of
        range, and for a time before the last one.
        """
        before = self.band
        level = self._levels.select(stiffness)
        self.band_changes += self.band is not before
        if self._limited and self._last_s is not None:
            self.limited_s += now_s - self._last_s
        felt = self._limit.limited(level, now_s)
        self._limited, self._last_s = felt < level, now_s
        shown = contact if self._settings.detent else None
        zone = self._detent.select(None if shown is None else SENSED_TRAVEL * self._travel.raw(shown))
        return with_detent(self.profiles.effects[felt], zone)

    def status(self) -> str:
        """A word or two for people."""
        return self.band.name.lower() + (" (eased)" if self._limited else "")

    def summary(self) -> dict[str, Any]:
        """The run's figures."""
        return {
            "reachable_zones": self.profiles.reachable_zones,
            "distinct_levels": self.profiles.distinct_levels,
            "band_changes": self.band_changes,
            "limited_s": self.limited_s,
        }


class RumbleSelector:
    """Danger along neither trigger to the motors' drive, with hysteresis: each change of a step is a write.

    The drive changes once the exact one has left it by a whole step, so that noise of half a step to either side makes
    no write once it has settled. Exactly 0 is always off, and 1 always full.
    """

    def __init__(self) -> None:
        self._step = 0

    def select(self, rumble: float) -> Rumble:
        """The motors' drive for `rumble`, 0 to 1."""
        exact = _RUMBLE_STEPS * rumble
        if rumble == 0.0 or abs(exact - self._step) >= 1.0:
            self._step = round(exact)
        return Rumble(left=self._step / _RUMBLE_STEPS)


class TriggerRendering:
    """Both triggers, and the motors for danger that lies along neither."""

    def __init__(
        self, settings: RenderingSettings, calibration: TravelCalibration, *, swap_sides: bool = False
    ) -> None:
        """`swap_sides`: what the robot side says of L2 is for R2, and the other way round."""
        self._swap_sides = swap_sides
        self.l2 = RenderedTrigger(settings, calibration.l2)
        self.r2 = RenderedTrigger(settings, calibration.r2)
        self._rumble = RumbleSelector()

    def render(self, felt: StiffnessUpdate | None, now_s: float) -> OutputReport:
        """What both triggers and the motors have to do at `now_s`; all off for None."""
        if felt is None:
            return OutputReport(
                self.l2.render(0.0, None, now_s), self.r2.render(0.0, None, now_s), self._rumble.select(0.0)
            )
        left, right = (felt.l2, felt.l2_contact), (felt.r2, felt.r2_contact)
        if self._swap_sides:
            left, right = right, left
        return OutputReport(
            l2=self.l2.render(*left, now_s),
            r2=self.r2.render(*right, now_s),
            rumble=self._rumble.select(felt.rumble),
        )

    def summary(self) -> dict[str, Any]:
        """The run's figures."""
        return {"l2": self.l2.summary(), "r2": self.r2.summary()}
