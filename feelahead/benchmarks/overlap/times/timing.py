"""Times of short calls, by the monotonic clock: the least of many, for other work on the machine only ever adds."""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from common.clock import Clock

_TURN_S = 0.03
"""What takes turns with others goes on for about so long."""


@dataclass(frozen=True)
class Contender:
    """What is timed beside others: a turn of it gives the least time (ns) that each of its parts took, (parts,).

    All parts together are `count` pairs.
    """

    name: str
    count: int
    turn: Callable[[], FloatArray]


def in_turns(contenders: Sequence[Contender], turns: int) -> dict[str, float]:
    """The least time (ns) of each part, summed over the parts, for a pair; by the name of the contender.

    Whatever else the machine does meets them alike, and a part is short enough to find it doing nothing else once.
    """
    least: dict[str, FloatArray] = {}
    for _ in range(turns):
        for contender in contenders:
            times = contender.turn()
            least[contender.name] = np.minimum(times, least.get(contender.name, times))
    return {contender.name: float(least[contender.name].sum()) / contender.count for contender in contenders}


def short_calls(
    name: str, parts: Sequence[Callable[[], object]], count: int, clock: Clock, *, threads: bool = False
) -> Contender:
    """A contender whose parts are calls in this process, each well below the milliseconds between interruptions.

    It is kept on one core unless it has `threads`.
    """

    def turn() -> FloatArray:
        with contextlib.nullcontext() if threads else one_core():
            return _least(parts, clock)

    return Contender(name, count, turn)


def _least(parts: Sequence[Callable[[], object]], clock: Clock) -> FloatArray:
    times_s = np.full(len(parts), np.inf)
    end_s = clock.now() + _TURN_S
    # Once to get warm, and once that counts, however long it takes.
    rounds = 0
    while rounds < 2 or clock.now() < end_s:
        for number, run in enumerate(parts):
            start_s = clock.now()
            run()
            times_s[number] = min(times_s[number], clock.now() - start_s)
        rounds += 1
    return 1e9 * times_s


def nanoseconds_each(run: Callable[[], object], count: int, repeats: int, clock: Clock) -> float:
    """The least over `repeats` calls of the time that `run` takes for each of `count` pairs, after one call more."""
    run()
    times_s = []
    for _ in range(repeats):
        start_s = clock.now()
        run()
        times_s.append(clock.now() - start_s)
    return 1e9 * min(times_s) / count


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
