"""Work in several processes at a time: each result as soon as it is there, and nothing left behind on Ctrl-C."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from common.errors import FeelaheadError

_LOOK_S = 1.0
Result = TypeVar("Result")


def in_processes(
    call: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], workers: int
) -> Generator[tuple[int, Result], None, None]:
    """The place of each of `tasks` with `call(*task)`, as they end; with 1 worker in this process, in order."""
    if workers == 1 or len(tasks) < 2:
        for place, task in enumerate(tasks):
            yield place, call(*task)
        return
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _end_with_parent, (os.getpid(),))
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
    except BrokenProcessPool as error:
        raise FeelaheadError(
            "a worker process was ended from outside: run again, with --resume where there is"
        ) from error
    finally:
        if not done:
            for child in multiprocessing.active_children():
                child.terminate()
        pool.shutdown()


def _end_with_parent(parent: int) -> None:
    """In a worker: end soon after whoever started it was killed."""

    def watch() -> None:
        never = threading.Event()
        while os.getppid() == parent:
            never.wait(_LOOK_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
