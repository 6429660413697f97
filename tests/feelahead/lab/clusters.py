"""Clusters of dask on loopback, for tests."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tests.helpers.repository import ROOT


@contextmanager
def dask_cluster(workers: int, scheme: str = "tcp", *flags: str) -> Iterator[tuple[str, list["subprocess.Popen[str]"]]]:
    """Start a dask scheduler and workers on loopback; yield its address and all processes, and end them afterwards."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> "subprocess.Popen[str]":
        call = [sys.executable, "-m", "dask", *arguments, "--no-dashboard", "--protocol", scheme, *flags]
        started.append(
            subprocess.Popen(
                call, cwd=ROOT, text=True, stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)}
            )
        )
        return started[-1]

    def said(process: "subprocess.Popen[str]", pattern: str) -> str:
        assert process.stderr is not None
        for line in process.stderr:
            if found := re.search(pattern, line):
                return found[1]
        raise AssertionError(f"the process ended before it said {pattern}")

    try:
        address = said(start("scheduler", "--host", "127.0.0.1", "--port", "0"), r"Scheduler at: +(t[cl][ps]://\S+)")
        for _ in range(workers):
            said(start("worker", address, "--nthreads", "1", "--no-nanny"), r"(Registered to)")
        yield address, started
    finally:
        for process in reversed(started):
            process.kill()
            process.communicate()
