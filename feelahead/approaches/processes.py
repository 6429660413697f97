"""Work in several processes at a time: each result as soon as it is there, and nothing left behind on Ctrl-C."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any, TypeVar

Result = TypeVar("Result")


def in_processes(
    call: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], workers: int
) -> Iterator[tuple[int, Result]]:
    """The place of each of `tasks` with `call(*task)`, as they end; with 1 worker in this process, in order."""
    if workers == 1 or len(tasks) < 2:
        for place, task in enumerate(tasks):
            yield place, call(*task)
        return
    pool = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))
    done = False
    try:
        # What is ignored as they start stays ignored in them: a Ctrl-C is ours to answer.
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            futures = {pool.submit(call, *task): place for place, task in enumerate(tasks)}
        finally:
            signal.signal(signal.SIGINT, before)
        for future in as_completed(futures):
            yield futures[future], future.result()
        done = True
    finally:
        if not done:
            for child in multiprocessing.active_children():
                child.terminate()
        pool.shutdown()
