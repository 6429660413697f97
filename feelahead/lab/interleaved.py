"""Run times of interleaved calls. The least of many times counts, as other work on the machine only adds time."""

import os
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from common.arrays import FloatArray
from common.clock import Clock

_ROUND_S = 0.03
"""Minimum length of a round, in seconds."""


def interleaved(contenders: Mapping[str, Callable[[], FloatArray]], rounds: int) -> dict[str, float]:
    """Return for each contender, by name, the sum of its parts' least times.

    A call of a contender returns the times of all its parts. A part is so short that some round leaves it undisturbed.
    Everything runs on one processor core, where the system can arrange this.
    """
    least: dict[str, FloatArray] = {}
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    try:
        if allowed:
            os.sched_setaffinity(0, {max(allowed)})
        for _ in range(rounds):
            for name, contender in contenders.items():
                times = contender()
                least[name] = np.minimum(times, least.get(name, times))
    finally:
        if allowed:
            os.sched_setaffinity(0, allowed)
    return {name: float(times.sum()) for name, times in least.items()}


def least_ns(parts: Sequence[Callable[[], object]], clock: Clock) -> FloatArray:
    """Call all parts in sequence, repeatedly for 30 ms and at least twice; return each part's least time in ns."""
    times_s, rounds, end_s = np.full(len(parts), np.inf), 0, clock.now() + _ROUND_S
    while rounds < 2 or clock.now() < end_s:
        for number, part in enumerate(parts):
            start_s = clock.now()
            part()
            times_s[number] = min(times_s[number], clock.now() - start_s)
        rounds += 1
    return 1e9 * times_s
