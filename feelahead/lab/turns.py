"""Times of calls in turns: the least of many, as other work on the machine only adds."""

import os
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from common.arrays import FloatArray
from common.clock import Clock

_TURN_S = 0.03
"""Least length of a turn, in seconds."""


def in_turns(contenders: Mapping[str, Callable[[], FloatArray]], turns: int) -> dict[str, float]:
    """Sum the least time of each contender's parts, by name; all stay on one core where the system can.

    A turn gives the times of all parts. Each part is short enough to run undisturbed in some turn.
    """
    least: dict[str, FloatArray] = {}
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    try:
        if allowed:
            os.sched_setaffinity(0, {max(allowed)})
        for _ in range(turns):
            for name, turn in contenders.items():
                times = turn()
                least[name] = np.minimum(times, least.get(name, times))
    finally:
        if allowed:
            os.sched_setaffinity(0, allowed)
    return {name: float(times.sum()) for name, times in least.items()}


def least_ns(parts: Sequence[Callable[[], object]], clock: Clock) -> FloatArray:
    """Call all parts one after another for 30 ms, twice at least; return the least ns of each."""
    times_s, rounds, end_s = np.full(len(parts), np.inf), 0, clock.now() + _TURN_S
    while rounds < 2 or clock.now() < end_s:
        for number, part in enumerate(parts):
            start_s = clock.now()
            part()
            times_s[number] = min(times_s[number], clock.now() - start_s)
        rounds += 1
    return 1e9 * times_s
