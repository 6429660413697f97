"""Garbage collection out of the way of the ticks: never by itself, only when there is time for it."""

import gc

from common.clock import Clock
from common.statistics import RunningStatistics

_RESTING_PERIOD_S = 10.0
"""While nothing moves, so often at most."""
_PRESSING_OBJECTS = 50_000
"""So many new objects that are still alive are looked at even while the arm moves, lest memory grow without end."""


class IdleCollection:
    """Freezes what exists, switches the collector off while it is open, and collects when told that there is time."""

    def __init__(self, clock: Clock) -> None:
        self.pauses = RunningStatistics()
        """How long each collection took, in seconds."""
        self._clock = clock
        self._next_s = clock.now() + _RESTING_PERIOD_S

    def __enter__(self) -> "IdleCollection":
        gc.collect()
        # What was built until now stays to the end: no later collection has to look at it again.
        gc.freeze()
        gc.disable()
        return self

    def __exit__(self, *_: object) -> None:
        gc.enable()
        gc.unfreeze()

    def idle(self, now_s: float, *, resting: bool) -> None:
        """Collect if it is time: while `resting`, every ten seconds; else only when much has gathered."""
        if (resting and now_s >= self._next_s) or gc.get_count()[0] > _PRESSING_OBJECTS:
            self._next_s = now_s + _RESTING_PERIOD_S
            began_s = self._clock.now()
            gc.collect()
            self.pauses.add(self._clock.now() - began_s)

    def summary(self) -> dict[str, float | int | None]:
        """`collections`, and the longest pause as `max_ms`."""
        longest_s = self.pauses.maximum
        return {"collections": self.pauses.count, "max_ms": None if longest_s is None else 1e3 * longest_s}
