"""Three bands of stiffness that fingers can tell apart, and the step between them.

People identify about 2.8 levels of stiffness absolutely (Cholewiak, Tan and Ebert 2008), so that 81 levels say
"more" and "less" but not "how much". Two steps, each large against a just-noticeable difference (6-15 %), mark
three bands: a finger that crosses one feels it.

    stiffness   0 ......... near ............ danger ......... 1
    level       0 to 12     28 to 40          56 to 80
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from operator_side.feel.force_profiles import MAX_LEVEL

STEP_LEVELS: Final = 16
"""The step from band to band, in levels: 1.6 strengths in the mean zone. It adds 133 % to the effect's own strength
at the lower threshold and 40 % at the upper one, by default; what share of the whole force that is, nobody has
published, as the trigger's own spring counts, too."""


class Band(IntEnum):
    """How much is in the way, in the three words that a finger can tell apart."""

    CLEAR = 0
    NEAR = 1
    DANGER = 2


@dataclass(frozen=True)
class BandSettings:
    """Where the bands begin, and whether they are marked at all."""

    marked: bool = True
    """Mark the bands by steps; without, the level is 80 times the stiffness throughout."""
    near: float = 0.25
    """The stiffness from which on it is near."""
    danger: float = 0.6
    """The stiffness from which on it is danger; above what a target may add (0.5), which is to be touched."""
    hysteresis: float = 0.04
    """A band is left downwards only this far below where it begins, lest a finger feels noise as steps."""

    def __post_init__(self) -> None:
        half_step = STEP_LEVELS / (2 * MAX_LEVEL)
        if not 0.0 <= self.hysteresis <= 0.1:  # false for NaN, too
            raise ValueError(f"hysteresis = {self.hysteresis}; valid: 0 to 0.1")
        if not (half_step < self.near and self.near + 2 * half_step < self.danger < 1.0 - half_step):
            raise ValueError(
                f"near = {self.near}, danger = {self.danger}; valid: near above {half_step}, danger above near by more"
                f" than {2 * half_step} and below {1.0 - half_step}: else no level is left between the steps"
            )

    def band(self, stiffness: float) -> Band:
        """The band that `stiffness`, 0 to 1, lies in."""
        return Band((stiffness >= self.near) + (stiffness >= self.danger))

    def exact_level(self, stiffness: float, band: Band) -> float:
        """The level, 0 to 80 and not rounded, of `stiffness` while `band` is in force.

        It never falls as `stiffness` or `band` grows. A stiffness outside the band has the level of its nearer end.
        """
        if not self.marked:
            return MAX_LEVEL * stiffness
        starts = (0.0, self.near, self.danger, 1.0)
        low, high = starts[band], starts[band + 1]
        half = STEP_LEVELS / 2
        bottom = MAX_LEVEL * low + (half if band > Band.CLEAR else 0.0)
        top = MAX_LEVEL * high - (half if band < Band.DANGER else 0.0)
        share = min(max((stiffness - low) / (high - low), 0.0), 1.0)
        return min(bottom + share * (top - bottom), top)


class BandSelector:
    """The band in force, with hysteresis downwards."""

    def __init__(self, settings: BandSettings) -> None:
        self._settings = settings
        self.band = Band.CLEAR

    def select(self, stiffness: float) -> Band:
        """The band for `stiffness`, 0 to 1: upwards at once, downwards once it is left by the hysteresis.

        ValueError for anything else, NaN included, and the band stays.
        """
        require_stiffness(stiffness)
        reached = self._settings.band(stiffness)
        held = self._settings.band(min(stiffness + self._settings.hysteresis, 1.0))
        self.band = max(reached, min(self.band, held))
        if stiffness == 0.0:
            self.band = Band.CLEAR
        return self.band


def require_stiffness(stiffness: float) -> None:
    """ValueError unless `stiffness` is a finite number from 0 to 1."""
    if not (math.isfinite(stiffness) and 0.0 <= stiffness <= 1.0):
        raise ValueError(f"stiffness = {stiffness}; valid: 0 to 1")
