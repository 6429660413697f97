"""The 81 force profiles of a trigger, each at least as stiff in every zone as the one before (§4.2).

Ten zones of eight strengths give 81 levels, each with one strength more in one zone than the level below: first
the zones that a full pull reaches, from the deep end, where it rests, towards the start; then those beyond. So a
profile grows with travel as far as travel counts, without a step down that would feel like a click.
"""

import itertools
from functools import cache
from typing import Final

from operator_side.dualsense.effects.official import (
    MAX_STRENGTH,
    ZONE_COUNT,
    MultiPositionFeedback,
    Off,
    TriggerEffect,
)

MAX_LEVEL: Final = ZONE_COUNT * MAX_STRENGTH
USUAL_REACHABLE_ZONES: Final = 8
"""Sensed travel ends at about 75 % of the mechanical travel, in the eighth zone (DS4Windows issue 1751)."""


class ForceProfiles:
    """The profile of every level, for a trigger whose full pull ends in its `reachable_zones`-th zone."""

    def __init__(self, reachable_zones: int = USUAL_REACHABLE_ZONES) -> None:
        """ValueError unless 1 to 10 zones are reachable."""
        if not 1 <= reachable_zones <= ZONE_COUNT:
            raise ValueError(f"reachable_zones = {reachable_zones}; valid: 1 to {ZONE_COUNT}")
        self.reachable_zones = reachable_zones
        order = (*reversed(range(reachable_zones)), *range(reachable_zones, ZONE_COUNT))
        self.effects: tuple[TriggerEffect, ...] = tuple(_effect(level, order) for level in range(MAX_LEVEL + 1))
        """Of level 0, which is Off, to level 80."""

    def felt(self, level: int) -> tuple[int, ...]:
        """The strengths of `level` in the reachable zones: all that a finger can feel of it."""
        return self.effects[level].zone_strengths[: self.reachable_zones]

    @property
    def felt_alike(self) -> tuple[tuple[int, ...], ...]:
        """Runs of levels that differ only in zones beyond a full pull, each of two levels or more."""
        runs = (tuple(run) for _, run in itertools.groupby(range(MAX_LEVEL + 1), key=self.felt))
        return tuple(run for run in runs if len(run) > 1)

    @property
    def distinct_levels(self) -> int:
        """How many levels differ at all within reach: one for each strength of each reachable zone, and Off."""
        return MAX_LEVEL + 1 - sum(len(run) - 1 for run in self.felt_alike)


def _effect(level: int, order: tuple[int, ...]) -> TriggerEffect:
    if level == 0:
        return Off()
    strengths = [level // ZONE_COUNT] * ZONE_COUNT
    for zone in order[: level % ZONE_COUNT]:
        strengths[zone] += 1
    return MultiPositionFeedback(tuple(strengths))


@cache
def force_profiles(reachable_zones: int = USUAL_REACHABLE_ZONES) -> ForceProfiles:
    """`ForceProfiles`, made once for each number of reachable zones."""
    return ForceProfiles(reachable_zones)
