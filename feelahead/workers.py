"""Processes of this machine that work at the same time, as an executor of concurrent.futures."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from common.errors import FeelaheadError

_LOOK_S = 1.0


@contextmanager
def processes(workers: int) -> Iterator[Executor]:
    """Yield a pool of `workers` processes on this machine; they end with this process, even by kill -9."""
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _end_with_parent, (os.getpid(),))
    try:
        # The workers inherit that SIGINT is ignored: only this process reacts to Ctrl-C.
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            for _ in range(workers):  # each starts one, as none is idle yet
                pool.submit(os.getpid)
        finally:
            signal.signal(signal.SIGINT, before)
        yield pool
    except BaseException as error:
        for child in multiprocessing.active_children():
            child.terminate()
        if isinstance(error, BrokenProcessPool):
            raise FeelaheadError("a worker process ended unexpectedly (killed, or out of memory)") from error
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _end_with_parent(parent: int) -> None:
    """Start a thread that ends this worker within a second after its parent process is gone."""

    def watch() -> None:
        never = threading.Event()
        while os.getppid() == parent:
            never.wait(_LOOK_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
