"""Check that a loop keeps its period; if it does not, one sentence per run names the cause and a remedy."""

from collections.abc import Callable
from typing import Any, Final

from common.clock import Clock
from common.realtime.pacing import Pacer
from common.realtime.stolen_time import StolenTime, read_stolen_time

WINDOW_S: Final = 5.0
_LEFT_OUT: Final = 0.05
"""Share of left-out turns above which the period counts as not kept; single ones occur on every machine."""
_FULL: Final = 0.8
"""Mean computing time of a turn, as a share of the period, from which on the machine counts as too slow."""
_UNDISTURBED: Final = 1.25
"""Ratio of wall time to processor time below which turns count as undisturbed by other programs."""


class PeriodMonitor:
    """Monitor of one loop, which judges windows of 5 s; the pacer's overruns are the turns left out."""

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
        """The sentence about a period that was not kept; None before."""
        self._pacer, self._wall, self._processor, self._remedy, self._taken = pacer, wall, processor, remedy, taken
        self._began_s = self._computed_s = 0.0
        self._worked_s = [0.0, 0.0]
        """Wall time and processor time of the loop's work in this window, without waiting."""
        self._first: tuple[float, StolenTime] | None = None
        self._window: tuple[float, StolenTime, int, int] | None = None

    def begin(self) -> None:
        """Note that the loop begins to work, after waiting."""
        self._began_s, self._computed_s = self._wall.now(), self._processor.now()

    def end(self, *, turned: bool) -> str | None:
        """Note that the loop begins to wait. `turned`: it has taken a turn. Return the sentence, at most once a run."""
        now_s = self._wall.now()
        self._worked_s[0] += now_s - self._began_s
        self._worked_s[1] += self._processor.now() - self._computed_s
        if not turned:
            return None
        if self._window is not None and now_s - self._window[0] < WINDOW_S:
            return None
        said, before = None, self._window
        taken = self._taken()
        if before is not None and self.said is None:
            self.said = said = self._judge(now_s, taken, *before)
        if self._first is None:
            self._first = now_s, taken
        self._window = now_s, taken, self._pacer.turns, self._pacer.overruns
        self._worked_s = [0.0, 0.0]
        return said

    def summary(self) -> dict[str, Any]:
        """Return `said`, and the shares of time that other programs (`waited`) and the host (`stolen`) took."""
        waited = stolen = None
        if self._first is not None:
            since_s, taken = self._first
            waited, stolen = self._taken().shares_since(taken, self._wall.now() - since_s)
        return {"said": self.said, "waited": waited, "stolen": stolen}

    def _judge(
        self, now_s: float, taken: StolenTime, since_s: float, before: StolenTime, turns: int, overruns: int
    ) -> str | None:
        turns, overruns = self._pacer.turns - turns, self._pacer.overruns - overruns
        if turns == 0 or overruns <= _LEFT_OUT * (turns + overruns):
            return None
        wall_s, computed_s = (worked_s / turns for worked_s in self._worked_s)
        waited, stolen = taken.shares_since(before, now_s - since_s)
        lost = max(waited or 0.0, stolen or 0.0)
        left_out = f"{100.0 * overruns / (turns + overruns):.0f} % of the turns are left out"
        undisturbed = wall_s < _UNDISTURBED * computed_s and lost < _LEFT_OUT
        if computed_s >= _FULL * self._pacer.period_s or undisturbed:
            return (
                f"this machine is too slow: a turn computes for {1e3 * computed_s:.2g} ms where there are"
                f" {1e3 * self._pacer.period_s:.2g} ms, and {left_out}; {self._remedy} would help"
            )
        whose = "closing other programs, or --realtime,"
        if stolen is not None and stolen > max(waited or 0.0, _LEFT_OUT):
            whose = f"its host took {100.0 * stolen:.0f} % of the time: a host with less to do"
        elif waited is not None and waited > _LEFT_OUT:
            whose = f"others had the processor for {100.0 * waited:.0f} % of the time: {whose}"
        return (
            f"this machine is too busy: a turn lasts {1e3 * wall_s:.2g} ms and computes for {1e3 * computed_s:.2g} ms,"
            f" and {left_out}; {whose} would help"
        )
