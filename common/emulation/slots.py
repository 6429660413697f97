"""netem's slots: times at which alone messages leave, each with room for a number of messages or bytes."""

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta

from common.limits import check_limits

SHORTEST_SLOT_S = 1e-4
_MOST_SLOTS = 20_000
"""A message due after this many of the shortest slots leaves in one of its own: what lies between is not drawn."""
_DRAWN_AT_ONCE = 256


@dataclass(frozen=True)
class Slot:
    """Times at which alone messages leave, each `least_s` to `most_s` after the one before."""

    least_s: float
    most_s: float
    packets: Annotated[int, Meta(ge=1)] | None = None
    """At most this many messages leave in one slot; None: any number."""
    size_bytes: Annotated[int, Meta(ge=1)] | None = None
    """The slot ends with the message that brings it to this many bytes; None: never."""

    def __post_init__(self) -> None:
        if not SHORTEST_SLOT_S <= self.least_s <= self.most_s < math.inf:
            raise ValueError(
                f"from {1e3 * self.least_s:g}ms to {1e3 * self.most_s:g}ms; "
                f"valid: {1e3 * SHORTEST_SLOT_S:g}ms or more, the shorter one first"
            )
        check_limits(self)


class SlotTimes:
    """The slots of one line, drawn as they are needed, and the room that is left in each."""

    def __init__(self, slot: Slot, generator: np.random.Generator) -> None:
        self._slot = slot
        self._generator = generator
        self._gaps_s = self._endless_gaps_s()
        self._times_s: list[float] = []
        self._packets_left: list[float] = []
        self._bytes_left: list[float] = []

    def take(self, due_s: float, now_s: float, size_bytes: int) -> float:
        """The first slot at or after `due_s` that has room, which a message of that size takes.

        After a time without messages slots begin anew, as in netem. Room is given in the order of asking.
        """
        times_s = self._times_s
        if not times_s or times_s[-1] < now_s:
            self._forget(len(times_s))
            self._add(now_s + next(self._gaps_s))
        if due_s - times_s[-1] > _MOST_SLOTS * self._slot.least_s:
            # Not among the others: a message that comes later may be due in between.
            return due_s + float(self._generator.random()) * next(self._gaps_s)
        while times_s[-1] < due_s:
            self._add(times_s[-1] + next(self._gaps_s))
        self._forget(bisect_left(times_s, now_s))
        place = bisect_left(times_s, due_s)
        while self._packets_left[place] <= 0.0 or self._bytes_left[place] <= 0.0:
            place += 1
            if place == len(times_s):
                self._add(times_s[-1] + next(self._gaps_s))
        self._packets_left[place] -= 1.0
        self._bytes_left[place] -= size_bytes
        return times_s[place]

    def _add(self, time_s: float) -> None:
        self._times_s.append(time_s)
        self._packets_left.append(math.inf if self._slot.packets is None else self._slot.packets)
        self._bytes_left.append(math.inf if self._slot.size_bytes is None else self._slot.size_bytes)

    def _forget(self, count: int) -> None:
        for values in (self._times_s, self._packets_left, self._bytes_left):
            del values[:count]

    def _endless_gaps_s(self) -> Iterator[float]:
        while True:
            yield from self._generator.uniform(self._slot.least_s, self._slot.most_s, _DRAWN_AT_ONCE).tolist()
