"""Check that a loop keeps its period. If it does not, a longer one is taken, and a sentence names cause and remedy."""

from collections.abc import Callable
from typing import Any, Final

from common.clock import Clock
from common.periods import period_text
from common.realtime.pacing import Pacer
from common.realtime.period_choice import PeriodChoice
from common.realtime.stolen_time import StolenTime, read_stolen_time
from common.statistics import RunningStatistics, microseconds

_FULL: Final = 0.8
"""Mean computing time of a turn, as a share of the period, from which on the machine counts as too slow."""
_UNDISTURBED: Final = 1.25
"""Ratio of wall time to processor time below which turns count as undisturbed by other programs."""
_TAKEN: Final = 0.05
"""Share of time from which on other programs, or the host, count as a cause"""


class PeriodMonitor:
    """Monitor of one loop, which changes the pacer's period when `PeriodChoice` does."""

    def __init__(
        self,
        pacer: Pacer,
        wall: Clock,
        processor: Clock,
        remedy: str,
        taken: Callable[[], StolenTime] = read_stolen_time,
    ) -> None:
        """remedy: what would shorten the loop's turns."""
        self.said: str | None = None
        """First sentence about a period that was not kept; None before."""
        self._pacer, self._wall, self._processor, self._remedy, self._taken = pacer, wall, processor, remedy, taken
        self._choice = PeriodChoice(pacer.period_s)
        self._computing = RunningStatistics()
        self._began_s = self._computed_s = 0.0
        self._turn_s, self._turn_computed_s = 0.0, 0.0
        """Wall time and processor time of the loop's work since the last turn, without waiting"""
        self._worked_s = [0.0, 0.0]
        """Wall time and processor time of the loop's work in this window"""
        self._first: tuple[float, StolenTime] | None = None
        self._window: tuple[float, StolenTime, int] | None = None

    def begin(self) -> None:
        """Note that the loop begins to work, after waiting."""
        self._began_s, self._computed_s = self._wall.now(), self._processor.now()

    def end(self, *, turned: bool) -> str | None:
        """Note that the loop begins to wait. `turned`: it has taken a turn. Return a sentence when one is due.

        One is due when the period changes, and the first time that even the longest period is not kept.
        """
        now_s = self._wall.now()
        self._turn_s += now_s - self._began_s
        self._turn_computed_s += self._processor.now() - self._computed_s
        if not turned:
            return None
        self._worked_s[0] += self._turn_s
        self._worked_s[1] += self._turn_computed_s
        self._computing.add(self._turn_computed_s)
        worked_s, self._turn_s, self._turn_computed_s = self._turn_s, 0.0, 0.0
        pacer, choice = self._pacer, self._choice
        if self._window is None:
            self._window = now_s, self._taken(), pacer.turns - 1
            self._first = self._window[:2]
        if not choice.turned(pacer.late_s, worked_s, pacer.missed, now_s):
            return None
        taken, before = self._taken(), self._window
        said = self._judge(now_s, taken, *before)
        self._window = now_s, taken, pacer.turns
        self._worked_s = [0.0, 0.0]
        return said

    def turn_cpu_us(self) -> dict[str, float | None]:
        """Return `p50`, `p99` and `max` of the processor time of all work from turn to turn, in microseconds."""
        return microseconds(self._computing)

    def summary(self) -> dict[str, Any]:
        """Return `said`, and the shares of time that other programs (`waited`) and the host (`stolen`) took."""
        waited = stolen = None
        if self._first is not None:
            since_s, taken = self._first
            waited, stolen = self._taken().shares_since(taken, self._wall.now() - since_s)
        return {"said": self.said, "waited": waited, "stolen": stolen}

    def _judge(self, now_s: float, taken: StolenTime, since_s: float, before: StolenTime, turns: int) -> str | None:
        choice, period_s = self._choice, self._pacer.period_s
        if choice.period_s != period_s:
            self._pacer.change(choice.period_s)
        if choice.kept:
            return f"turns begin every {period_text(choice.period_s)} again" if choice.period_s < period_s else None
        missed = f"{100.0 * choice.missed:.0f} % of the deadlines are missed"
        then = f": turns now begin every {period_text(choice.period_s)}" if choice.period_s > period_s else ""
        if self.said is not None:
            return f"{missed}{then}" if then else None
        wall_s, computed_s = (worked_s / (self._pacer.turns - turns) for worked_s in self._worked_s)
        waited, stolen = taken.shares_since(before, now_s - since_s)
        cause, remedy = self._cause(wall_s, computed_s, period_s, waited, stolen)
        self.said = f"{cause}, and {missed}{then}; {remedy} would help"
        return self.said

    def _cause(
        self, wall_s: float, computed_s: float, period_s: float, waited: float | None, stolen: float | None
    ) -> tuple[str, str]:
        """Return why a period is not kept, and a remedy; wall_s, computed_s: means of a turn."""
        undisturbed = wall_s < _UNDISTURBED * computed_s and max(waited or 0.0, stolen or 0.0) < _TAKEN
        if computed_s >= _FULL * period_s or undisturbed:
            where = f"computes for {1e3 * computed_s:.2g} ms where there are {1e3 * period_s:.2g} ms"
            return f"this machine is too slow: a turn {where}", self._remedy
        whose = "closing other programs, or --realtime,"
        if stolen is not None and stolen > max(waited or 0.0, _TAKEN):
            whose = f"its host took {100.0 * stolen:.0f} % of the time: a host with less to do"
        elif waited is not None and waited > _TAKEN:
            whose = f"others had the processor for {100.0 * waited:.0f} % of the time: {whose}"
        times = f"lasts {1e3 * wall_s:.2g} ms and computes for {1e3 * computed_s:.2g} ms"
        return f"this machine is too busy: a turn {times}", whose
