"""Show the progress of long work: a bar on a terminal; otherwise a line each minute, for a log."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from rich.console import Console
from rich.progress import Progress

from common.clock import MonotonicClock

_EVERY_S: Final = 60.0


class Shown:
    """Display of how much of the work is done, and which piece is under way."""

    def __init__(self, what: str, total: float, bars: Progress | None) -> None:
        """bars: progress bars of a terminal; if None, lines go to standard error instead."""
        self._what, self._total, self._done = what, total, 0.0
        self._bars, self._clock = bars, MonotonicClock()
        self._task = None if bars is None else bars.add_task(what, total=total)
        self._next_s = self._clock.now() + _EVERY_S

    def begin(self, piece: str) -> None:
        """Show the name of the piece of work that is now under way."""
        if self._bars is not None and self._task is not None:
            self._bars.update(self._task, description=f"{self._what}: {piece}")
        elif self._clock.now() >= self._next_s:
            self._next_s = self._clock.now() + _EVERY_S
            sys.stderr.write(f"{self._what}: {100.0 * self._done / self._total:.0f} %, {piece}\n")
            sys.stderr.flush()

    def advance(self, share: float) -> None:
        """Add `share` to the finished work, in the unit of the total."""
        self._done += share
        if self._bars is not None and self._task is not None:
            self._bars.advance(self._task, share)


@contextmanager
def progress(what: str, total: float) -> Iterator[Shown]:
    """Yield a display on standard error that shows how much of `total` is done."""
    if not sys.stderr.isatty():
        yield Shown(what, total, None)
        return
    # A piece may take minutes, so the time left is estimated from the whole run so far.
    with Progress(console=Console(stderr=True), transient=True, speed_estimate_period=1e6) as bars:
        yield Shown(what, total, bars)
