"""The kernels with vectors of 256 and of 512 bits, which LLVM chooses between by the name of the processor.

Each runs in a process of its own, for which Numba is told to prefer the one or the other, with an empty cache.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial

import numpy as np
from rich.progress import Progress

from common.arrays import FloatArray
from common.clock import MonotonicClock
from feelahead.benchmarks.overlap import ours as overlap_ours
from feelahead.benchmarks.overlap.times.speed import BATCH, TIMED_SOLIDS, partial_pairs
from feelahead.benchmarks.overlap.times.timing import Contender, in_turns, short_calls
from feelahead.benchmarks.report import Report, Table, short
from robot_side.compiled.processor import has_wide_vectors, vector_environment

_WIDTHS = (256, 512)
_SIZES = (8, BATCH)
_CALLS = 64
PAYS = 0.05
"""Wide vectors pay where they take so much less time."""


def measure_widths(report: Report, progress: Progress, turns: int) -> None:
    """Add ns a pair for both widths, in calls of a few and of many pairs; nothing without 512-bit vectors."""
    if not has_wide_vectors():
        return
    rows = []
    bar = progress.add_task("widths of vectors, compiling", total=None)
    with ExitStack() as stack:
        asked = {bits: stack.enter_context(_process(bits)) for bits in _WIDTHS}
        for process in asked.values():
            _answer(process)
        progress.update(bar, description="widths of vectors", total=len(TIMED_SOLIDS) * len(_SIZES))
        for solid in TIMED_SOLIDS:
            for size in _SIZES:
                contenders = [
                    Contender(str(bits), 1, partial(_ask, process, f"{solid} {size}"))
                    for bits, process in asked.items()
                ]
                times = in_turns(contenders, turns)
                for bits, each_ns in times.items():
                    case = f"{size} pairs a call"
                    report.add("widths", f"{bits} bits", solid, case, {"time": (each_ns, "ns/pair")})
                narrow, wide = times["256"], times["512"]
                rows.append((solid, str(size), short(narrow), short(wide), f"{100.0 * (1.0 - wide / narrow):.0f} %"))
                progress.advance(bar)
    report.tables.append(
        Table(
            "Wider vectors, ns a pair",
            ("solid", "pairs a call", "256 bits", "512 bits", "less time"),
            rows,
            "The kernels, compiled for either width, in turns; the other tables have what LLVM takes for this "
            "processor by itself.",
        )
    )


def wide_vectors_pay(report: Report) -> bool:
    """Whether they were measured to, for every solid in batches."""
    times = [
        tuple(report.value("widths", f"{bits} bits", solid, f"{BATCH} pairs a call", "time") for bits in _WIDTHS)
        for solid in TIMED_SOLIDS
    ]
    return all(narrow is not None and wide is not None and wide <= (1.0 - PAYS) * narrow for narrow, wide in times)


@contextmanager
def _process(bits: int) -> Iterator[subprocess.Popen[str]]:
    with tempfile.TemporaryDirectory(prefix="feelahead-widths-") as folder:
        environment = {**os.environ, **vector_environment(bits), "NUMBA_CACHE_DIR": folder}
        command = [sys.executable, "-P", "-m", __name__]
        with subprocess.Popen(
            command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            try:
                yield process
            finally:
                process.kill()


def _answer(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None  # noqa: S101
    line = process.stdout.readline()
    if not line:
        raise OSError("the process that measures widths of vectors ended")
    return line


def _ask(process: subprocess.Popen[str], question: str) -> FloatArray:
    assert process.stdin is not None  # noqa: S101
    process.stdin.write(f"{question}\n")
    process.stdin.flush()
    return np.array([float(_answer(process))])


def _serve() -> None:
    """Answer each line, a solid and the pairs of a call, with ns a pair of one turn."""
    clock = MonotonicClock()
    contenders = {}
    for solid in TIMED_SOLIDS:
        for size in _SIZES:
            pairs = partial_pairs(solid, min(size * _CALLS, BATCH))
            run = overlap_ours.calls(pairs, size, checked=False)
            contenders[f"{solid} {size}"] = short_calls("", [run], len(pairs), clock)
            run()
    print("ready", flush=True)
    for line in sys.stdin:
        contender = contenders[line.strip()]
        print(float(contender.turn().sum()) / contender.count, flush=True)


if __name__ == "__main__":
    _serve()
