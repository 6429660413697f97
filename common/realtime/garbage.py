"""Garbage collection in idle time, so that it does not delay a tick."""

import gc

from common.clock import Clock
from common.statistics import RunningStatistics

_RESTING_PERIOD_S = 10.0
"""Time between collections while nothing moves, in seconds."""
_PRESSING_OBJECTS = 50_000
"""Number of new objects beyond which garbage is collected even while the arm moves, to bound memory."""


class IdleCollection:
    """Context that replaces Python's automatic collector by `idle`; later collections skip objects made before it."""

    def __init__(self, clock: Clock) -> None:
        self.pauses = RunningStatistics()
        """Durations of collections, in seconds."""
        self._clock = clock
        self._next_s = clock.now() + _RESTING_PERIOD_S

    def __enter__(self) -> "IdleCollection":
        gc.collect()
        # Objects made until now live to the end: later collections skip them.
        gc.freeze()
        gc.disable()
        return self

    def __exit__(self, *_: object) -> None:
        gc.enable()
        gc.unfreeze()

    def idle(self, now_s: float, *, resting: bool) -> None:
        """Collect garbage if it is due: every ten seconds while `resting`, else only beyond _PRESSING_OBJECTS."""
        if (resting and now_s >= self._next_s) or gc.get_count()[0] > _PRESSING_OBJECTS:
            self._next_s = now_s + _RESTING_PERIOD_S
            began_s = self._clock.now()
            gc.collect()
            self.pauses.add(self._clock.now() - began_s)

    def summary(self) -> dict[str, float | int | None]:
        """Return the number of `collections` in idle time, and the longest as `max_ms`."""
        longest_s = self.pauses.maximum
        return {"collections": self.pauses.count, "max_ms": None if longest_s is None else 1e3 * longest_s}
