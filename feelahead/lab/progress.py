"""Show how far long work has got, with the time left: a bar for people, a line a minute for a log."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column

from common.clock import MonotonicClock

_EVERY_S = 60.0
_WHOLE_RUN_S = 1e6
"""A piece may take minutes: the time left is reckoned from the whole run so far."""


class Shown(Protocol):
    """Take what the work tells of itself."""

    def begin(self, piece: str) -> None:
        """Name the piece of work that takes its time now."""

    def advance(self, share: float) -> None:
        """Count what is done."""


@contextmanager
def progress(what: str, total: float) -> Iterator[Shown]:
    """Show on standard error how much of `total` is done, and for how long the present piece has been at work."""
    if sys.stderr.isatty():
        name = TextColumn("{task.description}", table_column=Column(no_wrap=True, overflow="ellipsis", ratio=1))
        parts = (BarColumn(20), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        screen = Console(stderr=True)
        with Progress(
            *(SpinnerColumn(), name, *parts),
            console=screen,
            transient=True,
            expand=True,
            speed_estimate_period=_WHOLE_RUN_S,
        ) as bars:
            yield _Bars(bars, what, total)
        return
    log, over = _Log(what, total), threading.Event()
    thread = threading.Thread(target=log.tell_until, args=(over,), daemon=True)
    thread.start()
    try:
        yield log
    finally:
        over.set()
        thread.join()


class _Bars:
    """A bar for the whole, and below it the present piece with a spinner and its time."""

    def __init__(self, bars: Progress, what: str, total: float) -> None:
        self._bars = bars
        self._whole = bars.add_task(what, total=total)
        self._piece = bars.add_task("", total=None, visible=False)
        self._named = ""

    def begin(self, piece: str) -> None:
        """Start its time, unless it is the one at work."""
        if piece != self._named:
            self._named = piece
            self._bars.reset(self._piece, total=None, visible=True, description=piece)

    def advance(self, share: float) -> None:
        """Move the bar of the whole."""
        self._bars.advance(self._whole, share)


class _Log:
    """A line a minute."""

    def __init__(self, what: str, total: float) -> None:
        self._what, self._total, self._done, self._piece = what, total, 0.0, ""
        self._clock = MonotonicClock()
        self._start_s = self._piece_s = self._clock.now()

    def begin(self, piece: str) -> None:
        """Start its time, unless it is the one at work."""
        if piece != self._piece:
            self._piece, self._piece_s = piece, self._clock.now()

    def advance(self, share: float) -> None:
        """Count it."""
        self._done += share

    def tell_until(self, over: threading.Event) -> None:
        """Write the lines."""
        while not over.wait(_EVERY_S):
            sys.stderr.write(self.line(self._clock.now()) + "\n")
            sys.stderr.flush()

    def line(self, now_s: float) -> str:
        """Say how far it is, what is at work, and the time that is left."""
        left = "time left unknown"
        if self._done > 0.0:
            left = f"about {(now_s - self._start_s) * (self._total / self._done - 1.0) / 60.0:.0f} min left"
        at = f", {self._piece} for {(now_s - self._piece_s) / 60.0:.0f} min" if self._piece else ""
        return f"{self._what}: {100.0 * self._done / self._total:.0f} %, {left}{at}"
