"""Turns of a loop at absolute deadlines. Missed deadlines are counted as overruns, and never made up for."""

import math
from collections import deque
from collections.abc import Callable
from typing import Any

from common.clock import Clock
from common.statistics import RunningStatistics

SPIN_S = 200e-6
"""Duration of the busy loop before a message is released, in seconds. A sleep ends 70 us late on average, and one in
twenty 300 us late, which is nothing to a turn. A busy loop ends 0.1 us late, but before each turn of 4 ms it would take
a twentieth of a core."""

_SHORTEST_SLEEP_S = 1e-6
_MOST_CHANGES = 100


class Pacer:
    """Deadlines of turns at `start_s + k period_s`, k = 0, 1, 2, ..., whatever the delays of earlier turns.

    `change` begins another such row at the next deadline.
    """

    def __init__(self, period_s: float, start_s: float, seed: int = 0) -> None:
        if not (math.isfinite(period_s) and period_s > 0.0 and math.isfinite(start_s)):
            raise ValueError(f"period_s = {period_s}, start_s = {start_s}; valid: finite seconds, the period above 0")
        self.period_s = period_s
        self.deadline_s: float
        """Deadline of the next turn."""
        self.turns = 0
        """Number of turns taken."""
        self.overruns = 0
        """Number of missed deadlines: a turn began so late that the next deadlines had passed, too."""
        self.missed = 0
        """Number of deadlines that the present turn missed"""
        self.late_s = 0.0
        """Time from the present turn's deadline to its begin, in seconds"""
        self.changes: deque[tuple[float, float]] = deque(maxlen=_MOST_CHANGES)
        """Newest changes of the period: time since the start and period, in seconds"""
        self.wake_error = RunningStatistics(seed)
        """Statistics of the times from a turn's deadline to its begin, in seconds."""
        self._latest_s = 0.0
        self.restart(start_s)

    def restart(self, start_s: float) -> None:
        """Begin again with the first deadline at `start_s`; keep the counts."""
        self._began_s = self._start_s = self.deadline_s = start_s
        self._deadline = 0

    def change(self, period_s: float) -> None:
        """Take another period from the next deadline on."""
        self._start_s, self._deadline, self.period_s = self.deadline_s, 0, period_s
        self.changes.append((self.deadline_s - self._began_s, period_s))

    def due(self, now_s: float) -> bool:
        """Return whether it is time for a turn."""
        return now_s >= self.deadline_s

    def begin(self, now_s: float) -> None:
        """Begin a turn at `now_s`; the next is due at the first later deadline. ValueError if the turn is not due."""
        if not now_s >= self.deadline_s:
            raise ValueError(f"now_s = {now_s} lies before the deadline; valid: {self.deadline_s} or later")
        self.turns += 1
        self.late_s = now_s - self.deadline_s
        self.wake_error.add(self.late_s)
        self._latest_s = max(self._latest_s, self.late_s)
        following = max(self._deadline + 1, math.floor((now_s - self._start_s) / self.period_s))
        while self._start_s + following * self.period_s <= now_s:
            following += 1
        self.missed = following - self._deadline - 1
        self.overruns += self.missed
        self._deadline = following
        self.deadline_s = self._start_s + following * self.period_s

    def take_latest_s(self) -> float:
        """Return the largest time from a turn's deadline to its begin since the last call, in seconds."""
        latest_s, self._latest_s = self._latest_s, 0.0
        return latest_s

    def summary(self) -> dict[str, Any]:
        """Return `period_ms`, `period_changes`, `overruns`, and `wake_error_us`.

        period_changes: pairs of time_s since the start and period_ms. wake_error_us has `p50`, `p99` and `max`, None
        before the first turn.
        """
        values_s = {
            "p50": self.wake_error.quantile(0.50),
            "p99": self.wake_error.quantile(0.99),
            "max": self.wake_error.maximum,
        }
        return {
            "period_ms": 1e3 * self.period_s,
            "period_changes": [{"time_s": time_s, "period_ms": 1e3 * period_s} for time_s, period_s in self.changes],
            "overruns": self.overruns,
            "wake_error_us": {name: None if value is None else 1e6 * value for name, value in values_s.items()},
        }


def wait_for_turn(
    pacer: Pacer, clock: Clock, wait: Callable[[float], bool], other_s: float | None = None, spin_s: float = SPIN_S
) -> bool:
    """Wait until a message arrives, or until the pacer's deadline or `other_s`, whichever is earlier.

    Return whether a message arrived. `wait(timeout_s)` waits for a message and returns whether there is one; it may
    return early. For the last `spin_s` before `other_s`, when an emulated link releases a message, it is called with a
    timeout of 0 in a busy loop, so that the message is in time.
    """
    due_s = pacer.deadline_s if other_s is None else min(pacer.deadline_s, other_s)
    spin_s = spin_s if due_s == other_s else 0.0
    while (asleep_s := due_s - spin_s - clock.now()) > _SHORTEST_SLEEP_S:
        if wait(asleep_s):
            return True
    while clock.now() < due_s:
        if wait(0.0):
            return True
    return False
