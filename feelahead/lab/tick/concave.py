"""Measure looks at concave objects in turns with "mixed"; calls begin at least a millisecond apart, as ticks do."""

import itertools
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.realtime.pacing import SPIN_S
from feelahead.lab.approaches.frozen import SITE
from feelahead.lab.field import Facing, looks_before
from feelahead.lab.tick.mixed import Mixed

_FREE_MM: Final = tuple(np.linspace(5.0, 150.0, 30).tolist())
_CHUNK: Final = 20
_PERIOD_S: Final = 1e-3


def time_looks(model: Path, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Measure looks at the object of `model` in chunks, with "mixed" in between; return processor times of both (s)."""
    looks, mixed = itertools.cycle(list(looks_before(Facing(model.stem, model, SITE, 5.0), _FREE_MM))), Mixed()
    looks_s, mixed_s = list[float](), list[float]()
    for _ in _FREE_MM:
        next(looks)()
    end_s = time.perf_counter() + seconds
    while time.perf_counter() < end_s:
        mixed_s += _chunk(itertools.repeat(mixed.work))
        looks_s += _chunk(looks)
    return np.array(looks_s), np.array(mixed_s)


def _chunk(works: Iterator[Callable[[], object]]) -> list[float]:
    """Return the processor times of a chunk of calls; the first call, which comes after other work, does not count."""
    spent_s = []
    for work in itertools.islice(works, _CHUNK):
        # Sleep, then spin to the next millisecond.
        due_s = _PERIOD_S * (1 + math.floor(time.perf_counter() / _PERIOD_S))
        time.sleep(max(due_s - time.perf_counter() - SPIN_S, 0.0))
        while time.perf_counter() < due_s:
            pass
        began_s = time.thread_time()
        work()
        spent_s.append(time.thread_time() - began_s)
    return spent_s[1:]
