"""A limit on full force that lasts: fingers tire, and motors that hold a force get warm.

No public figure says how long a trigger's motor bears its full force, so this claims none: the defaults are chosen
for the finger, and low enough to be kind to the motor.
"""

import math
from dataclasses import dataclass

from operator_side.dualsense.effects.official import MAX_STRENGTH, ZONE_COUNT
from operator_side.feel.force_profiles import MAX_LEVEL


@dataclass(frozen=True)
class SustainedForceSettings:
    """When and how far a force that lasts is lowered."""

    longest_s: float = 10.0
    """How long a trigger may ask for full force before it is lowered; 0 lowers it at once."""
    full_strength: int = 6
    """A profile is full force when it has this strength, of 8, in any zone that a full pull reaches."""
    sustainable_strength: int = 5
    """What it is lowered to; above the band `near`, so that danger still feels like more."""
    fade_s: float = 5.0
    """How slowly it is lowered, and comes back."""

    def __post_init__(self) -> None:
        for name, low, high in (("longest_s", 0.0, 3600.0), ("fade_s", 0.1, 3600.0)):
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: {low} to {high}")
        if not 1 <= self.sustainable_strength < self.full_strength <= MAX_STRENGTH:
            raise ValueError(
                f"sustainable_strength = {self.sustainable_strength}, full_strength = {self.full_strength}; valid: 1 to"
                f" {MAX_STRENGTH}, the first below the second"
            )


class SustainedForceLimit:
    """The highest level that one trigger may have now: all of them, until full force has been asked for too long.

    Time at full force adds up to `longest_s` and the fade; time below it counts back at the same rate, so that the
    limit goes as slowly as it came, and a rest of both makes the trigger fresh again.
    """

    def __init__(self, settings: SustainedForceSettings) -> None:
        self._settings = settings
        # A round of ten levels gives one strength more to each zone, and begins with one that a full pull reaches.
        self._full_level = ZONE_COUNT * (settings.full_strength - 1) + 1
        self._sustainable_level = ZONE_COUNT * settings.sustainable_strength
        self._exertion_s = 0.0
        self._full = False
        self._last_s: float | None = None

    def limited(self, level: int, now_s: float) -> int:
        """`level`, 0 to 80, or the lower one that is sustainable now. Never falls as `level` grows.

        `level` counts as asked for until the next call. ValueError for a time before the last one.
        """
        settings = self._settings
        if self._last_s is not None:
            if not (math.isfinite(now_s) and now_s >= self._last_s):
                raise ValueError(f"now_s = {now_s}; valid: {self._last_s}, the last time given, or later")
            step_s = now_s - self._last_s
            self._exertion_s = min(
                max(self._exertion_s + (step_s if self._full else -step_s), 0.0), settings.longest_s + settings.fade_s
            )
        self._last_s = now_s
        self._full = level >= self._full_level
        return min(level, self.highest_level)

    @property
    def highest_level(self) -> int:
        """What no level may exceed now, 80 while the trigger is fresh."""
        settings = self._settings
        lowered = min(max((self._exertion_s - settings.longest_s) / settings.fade_s, 0.0), 1.0)
        return round(MAX_LEVEL - lowered * (MAX_LEVEL - self._sustainable_level))
