"""Times of calls, by the monotonic clock."""

import contextlib
import os
import statistics
from collections.abc import Callable, Iterator

from common.clock import Clock

ROUNDS = 3
"""So many times each measurement is made, the best of which counts: other work on the machine comes in bursts."""


def nanoseconds_each(run: Callable[[], object], count: int, repeats: int, clock: Clock) -> float:
    """The median over `repeats` calls of the time that `run` takes for each of `count` pairs, after one call more."""
    run()
    times_s = []
    for _ in range(repeats):
        start_s = clock.now()
        run()
        times_s.append(clock.now() - start_s)
    return 1e9 * statistics.median(times_s) / count


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Keep this thread, and the processes and threads that it starts, on one core where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def available_cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
