"""Stiffness to trigger effect: one of 81 force profiles, each at least as stiff in every zone as the last (§4.2).

Ten zones of eight strengths give 81 levels. Each level above a full round of ten adds one strength to one more
zone: first the zones that the controller can sense, from the deep end, where a fast pull rests, towards the
start. So a profile grows with travel as far as travel is sensed, without a step down that would feel like a
click. The zones beyond come last.
"""

import math
from typing import Final

from operator_side.dualsense.effects import (
    MAX_STRENGTH,
    ZONE_COUNT,
    MultiPositionFeedback,
    Off,
    TriggerEffect,
)

MAX_LEVEL: Final = ZONE_COUNT * MAX_STRENGTH

_FILLING_ORDER: Final = (7, 6, 5, 4, 3, 2, 1, 0, 8, 9)
"""Sensed travel ends at about 75 % of the mechanical travel, in zone 7 (DS4Windows issue 1751)."""


def _effect_of_level(level: int) -> TriggerEffect:
    if level == 0:
        return Off()
    strengths = [level // ZONE_COUNT] * ZONE_COUNT
    for zone in _FILLING_ORDER[: level % ZONE_COUNT]:
        strengths[zone] += 1
    return MultiPositionFeedback(tuple(strengths))


_EFFECTS: Final = tuple(_effect_of_level(level) for level in range(MAX_LEVEL + 1))


def _exact_level(stiffness: float) -> float:
    if not (math.isfinite(stiffness) and 0.0 <= stiffness <= 1.0):
        raise ValueError(f"stiffness = {stiffness}; valid: 0 to 1")
    return MAX_LEVEL * stiffness


def stiffness_to_effect(stiffness: float) -> TriggerEffect:
    """The profile of level round(80 s): ten zones that sum to the level; Off at level 0.

    `stiffness`: the paper's §4.2, 0 to 1. Every zone's strength grows or stays as the stiffness grows.
    ValueError for anything else, NaN included.
    """
    return _EFFECTS[round(_exact_level(stiffness))]


class EffectSelector:
    """`stiffness_to_effect` with hysteresis, so that noise around half a level does not make a trigger chatter.

    The level changes once the stiffness has left it by more than half a level and `margin` more. A stiffness of
    exactly 0 is always Off.
    """

    def __init__(self, margin: float = 0.25) -> None:
        """`margin`: in levels, from 0 to below 0.5 so that every level, the last one too, can be reached."""
        if not 0.0 <= margin < 0.5:
            raise ValueError(f"margin = {margin}; valid: 0 to below 0.5 of a level")
        self._threshold = 0.5 + margin
        self._level = 0

    @property
    def level(self) -> int:
        """The level in force, 0 to 80."""
        return self._level

    def select(self, stiffness: float) -> TriggerEffect:
        """The effect for `stiffness`, 0 to 1; ValueError for anything else, and the level stays."""
        exact = _exact_level(stiffness)
        if stiffness == 0.0 or abs(exact - self._level) > self._threshold:
            self._level = round(exact)
        return _EFFECTS[self._level]
