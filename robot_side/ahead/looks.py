"""What was seen of what is ahead lately, along each side and from each place; the shortest ways hold."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.field import Field
from robot_side.arm.ability import Ability

STEADY_S: Final = 0.1
"""For so long a way that was found holds; as long as strength takes to fall in the trigger."""
_SAME_DIRECTION: Final = 0.999
"""Cosine: 2.6° to either side."""


@dataclass(frozen=True)
class Seen:
    """One field as it was found, and what held then."""

    field: Field
    direction: FloatArray
    tool_m: FloatArray
    ability: Ability
    reach_m: float
    at_s: float
    overlap_m3: float

    def moved_m(self, tool_m: FloatArray) -> float:
        """How far the tool has got along the field's direction since."""
        return float(self.direction @ (tool_m - self.tool_m))


class _Looks:
    """What was seen along one side from one place lately, the newest last; there is always one."""

    def __init__(self, first: Seen) -> None:
        self._kept: list[Seen] = []
        self.add(first)

    @property
    def newest(self) -> Seen:
        """The field of the last look."""
        return self._kept[-1]

    def add(self, seen: Seen) -> None:
        """Take one in, and forget those that hold no more: too old, or along another direction."""
        self._kept = [
            one
            for one in self._kept
            if seen.at_s - one.at_s < STEADY_S and one.direction @ seen.direction > _SAME_DIRECTION
        ]
        self._kept.append(seen)
        # Put together here, as the ways are asked for in every tick.
        self._ways_m = np.array([(one.field.fast_m, one.field.slow_m) for one in self._kept])
        self._directions = np.array([one.direction for one in self._kept])
        self._began_m = np.array([one.direction @ one.tool_m for one in self._kept])

    def ways_m(self, tool_m: FloatArray) -> FloatArray:
        """The shortest fast and slow ways (2, 8) from where the tool is now."""
        moved_m = self._directions @ tool_m - self._began_m
        shortest: FloatArray = (self._ways_m - moved_m[:, None, None]).min(axis=0)
        return shortest


class Places:
    """What was seen along one side from all places: the first is where the gripper is."""

    def __init__(self) -> None:
        self._looks: list[_Looks] = []

    def age_s(self, place: int, now_s: float) -> float:
        """How long ago it was last looked from there; infinite where it never was."""
        return now_s - self._looks[place].newest.at_s if place < len(self._looks) else math.inf

    def add(self, place: int, seen: Seen) -> None:
        """Take a look in, from a known place or the next one."""
        if place < len(self._looks):
            self._looks[place].add(seen)
        else:
            self._looks.append(_Looks(seen))

    def keep(self, places: int) -> None:
        """Forget all places from this one on."""
        del self._looks[places:]

    @property
    def newest(self) -> Seen:
        """The newest look from where the gripper is."""
        return self._looks[0].newest

    def ways_m(self, tool_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The shortest fast and slow ways (8,) from where the tool is now."""
        fast, slow = np.min([looks.ways_m(tool_m) for looks in self._looks], axis=0)
        return fast, slow

    def known_m(self, tool_m: FloatArray) -> float:
        """How far ahead of the tool anything is known."""
        return self.newest.reach_m - self.newest.moved_m(tool_m)
