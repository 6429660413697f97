"""How far long work has got, with the time left: a bar for people, a line now and then for a log."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from common.clock import MonotonicClock

_EVERY_S = 60.0
_WHOLE_RUN_S = 1e6
"""A piece may take minutes: the time left is reckoned from the whole run so far."""
Advance = Callable[[float], None]


@contextmanager
def progress(what: str, total: float) -> Iterator[Advance]:
    """Show on standard error how much of `total` is done; call what is yielded with each piece's share of it."""
    if sys.stderr.isatty():
        columns = (TextColumn(what), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        screen = Console(stderr=True)
        with Progress(*columns, console=screen, transient=True, speed_estimate_period=_WHOLE_RUN_S) as bars:
            bar = bars.add_task(what, total=total)
            yield lambda share: bars.advance(bar, share)
        return
    clock = MonotonicClock()
    start_s = said_s = clock.now()
    done = 0.0

    def advance(share: float) -> None:
        nonlocal done, said_s
        done += share
        now_s = clock.now()
        if now_s - said_s >= _EVERY_S:
            said_s = now_s
            left_min = (now_s - start_s) * (total / done - 1.0) / 60.0
            sys.stderr.write(f"{what}: {100.0 * done / total:.0f} %, about {left_min:.0f} min left\n")
            sys.stderr.flush()

    yield advance
