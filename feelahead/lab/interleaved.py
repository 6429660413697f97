"""Times of interleaved calls: the least wall time, as other work only adds time, or the median processor time."""

import os
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from common.arrays import FloatArray
from common.clock import Clock

_Name = TypeVar("_Name", bound=Hashable)
_ROUND_S = 0.03
"""Minimum length of a round, in seconds."""
_CHUNK_S = 0.004
"""Minimum length of a chunk whose processor time is measured, in seconds."""


def in_turns(contenders: Mapping[_Name, Callable[[], FloatArray]], rounds: int) -> dict[_Name, FloatArray]:
    """Return for each contender, by name, the times (rounds, parts) that its calls return; they take turns.

    Everything runs on one processor core, where the system can arrange this.
    """
    times: dict[_Name, list[FloatArray]] = {name: [] for name in contenders}
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    try:
        if allowed:
            os.sched_setaffinity(0, {max(allowed)})
        for _ in range(rounds):
            for name, contender in contenders.items():
                times[name].append(contender())
    finally:
        if allowed:
            os.sched_setaffinity(0, allowed)
    return {name: np.array(of_rounds) for name, of_rounds in times.items()}


def interleaved(contenders: Mapping[str, Callable[[], FloatArray]], rounds: int) -> dict[str, float]:
    """Return for each contender, by name, the sum of its parts' least times.

    A call of a contender returns the times of all its parts. A part is so short that some round leaves it undisturbed.
    """
    return {name: float(times.min(axis=0).sum()) for name, times in in_turns(contenders, rounds).items()}


def processor_us(works: Mapping[_Name, Callable[[], object]], rounds: int) -> dict[_Name, float]:
    """Return for each work, by name, the median processor time of a call in µs, over `rounds` chunks that take turns.

    A chunk lasts 4 ms and has one call at least. Its first call, which comes after other work, does not count, unless
    it is as long as a chunk.
    """
    contenders = {name: partial(_chunk_us, work) for name, work in works.items()}
    return {name: float(np.median(times)) for name, times in in_turns(contenders, rounds).items()}


def _chunk_us(work: Callable[[], object]) -> FloatArray:
    began_s = time.process_time()
    work()
    now_s = time.process_time()
    if now_s - began_s >= _CHUNK_S:
        return np.array([1e6 * (now_s - began_s)])
    calls, began_s = 0, now_s
    while now_s - began_s < _CHUNK_S:
        work()
        calls, now_s = calls + 1, time.process_time()
    return np.array([1e6 * (now_s - began_s) / calls])


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
