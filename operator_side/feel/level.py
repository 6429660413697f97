"""Stiffness to trigger effect: which of the 81 force profiles a trigger takes on (§4.2)."""

from operator_side.dualsense.effects.official import TriggerEffect
from operator_side.feel.bands import Band, BandSelector, BandSettings, require_stiffness
from operator_side.feel.force_profiles import MAX_LEVEL, force_profiles

_UNMARKED = BandSettings(marked=False)


def stiffness_to_effect(stiffness: float) -> TriggerEffect:
    """The profile of level round(80 s), without marked bands: ten zones that sum to the level; Off at level 0.

    `stiffness`: the paper's §4.2, 0 to 1. Every zone's strength grows or stays as the stiffness grows.
    ValueError for anything else, NaN included.
    """
    require_stiffness(stiffness)
    return force_profiles().effects[round(MAX_LEVEL * stiffness)]


class LevelSelector:
    """Stiffness to level, with hysteresis: noise of half a level to either side does not make a trigger chatter.

    The level changes once the exact one has left it by more than half a level and `margin` more, and comes back once
    it has changed by twice the margin. A stiffness of exactly 0 is always level 0.
    """

    def __init__(self, bands: BandSettings = _UNMARKED, margin: float = 0.49) -> None:
        """`margin`: in levels, from 0 to below 0.5 so that every level, the last one too, can be reached."""
        if not 0.0 <= margin < 0.5:
            raise ValueError(f"margin = {margin}; valid: 0 to below 0.5 of a level")
        self._threshold = 0.5 + margin
        self._settings = bands
        self._bands = BandSelector(bands)
        self._level = 0

    @property
    def level(self) -> int:
        """The level in force, 0 to 80."""
        return self._level

    @property
    def band(self) -> Band:
        """The band in force."""
        return self._bands.band

    def select(self, stiffness: float) -> int:
        """The level for `stiffness`, 0 to 1; ValueError for anything else, and the level stays."""
        exact = self._settings.exact_level(stiffness, self._bands.select(stiffness))
        if stiffness == 0.0 or abs(exact - self._level) > self._threshold:
            self._level = round(exact)
        return self._level
