"""Choice of a loop's period: the one asked for, or a longer one while the machine cannot keep it.

asked for ─▶ 5 ms ─▶ 8 ms ─▶ ...    deadlines are missed again and again
          ◀─      ◀─      ◀─        for a while nearly all turns would have ended within the shorter period
"""

from typing import Final

from common.periods import PERIODS_S

WINDOW_S: Final = 2.0
"""Time for which turns are counted before they are judged, in seconds"""
MISSED: Final = 0.02
"""Share of missed deadlines above which a period counts as not kept; single ones occur on every machine."""
_TIMES: Final = 4
"""Least number of turns in a window that miss deadlines: one pause, however long, is no reason for a longer period."""
_UNFIT: Final = 0.01
"""Largest share of turns that may be too long for a shorter period"""
PATIENCE_S: Final = 10.0
"""Time for which turns must fit a shorter period before it is taken, in seconds"""
_LONGEST_PATIENCE_S: Final = 640.0


class PeriodChoice:
    """Choice among the period asked for and all longer ones of `PERIODS_S`, from the times of each turn.

    A shorter period that proves too short soon again is tried twice as late the next time.
    """

    def __init__(self, asked_s: float) -> None:
        self.periods_s = (asked_s, *(period_s for period_s in PERIODS_S if period_s > asked_s))
        """Periods to choose from, in seconds, the one asked for first"""
        self.missed = 0.0
        """Share of deadlines missed in the last whole window"""
        self._place = 0
        self._window_s: float | None = None
        self._turns = self._overruns = self._late = self._unfit = 0
        self._calm_s, self._patience_s = 0.0, PATIENCE_S
        self._shortened_s: float | None = None

    @property
    def period_s(self) -> float:
        """Present period, in seconds."""
        return self.periods_s[self._place]

    @property
    def kept(self) -> bool:
        """Whether the period was kept in the last whole window"""
        return self.missed <= MISSED

    def turned(self, late_s: float, worked_s: float, overruns: int, now_s: float) -> bool:
        """Take a turn that ends at `now_s`; return whether a window is over, so that the period may have changed.

        late_s: from the turn's deadline to its begin. worked_s: wall time of all work since the turn before, without
        waiting. overruns: deadlines missed before this turn.
        """
        if self._window_s is None:
            self._window_s = now_s
        self._turns += 1
        self._overruns += overruns
        self._late += overruns > 0
        self._unfit += self._place > 0 and late_s + worked_s >= self.periods_s[self._place - 1]
        if now_s - self._window_s < WINDOW_S:
            return False
        self._judge(now_s)
        self._window_s = now_s
        self._turns = self._overruns = self._late = self._unfit = 0
        return True

    def _judge(self, now_s: float) -> None:
        self.missed = self._overruns / (self._turns + self._overruns) if self._late >= _TIMES else 0.0
        if not self.kept:
            self._calm_s = 0.0
            if self._place + 1 < len(self.periods_s):
                self._place += 1
                if self._shortened_s is not None:
                    soon = now_s - self._shortened_s < self._patience_s
                    self._patience_s = min(2.0 * self._patience_s, _LONGEST_PATIENCE_S) if soon else PATIENCE_S
                    self._shortened_s = None
        elif self._place > 0:
            self._calm_s = self._calm_s + WINDOW_S if self._unfit <= _UNFIT * self._turns else 0.0
            if self._calm_s >= self._patience_s:
                self._place -= 1
                self._calm_s, self._shortened_s = 0.0, now_s
