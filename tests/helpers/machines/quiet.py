"""Judging by milliseconds: only a machine that does nothing else keeps them."""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

_MOST: Final = 0.1
"""Share of one processor that other programs and the host may take while something is judged"""
_STOLEN: Final = 8
"""Index of `steal` in the first line of /proc/stat"""


@contextlib.contextmanager
def judged() -> Iterator[None]:
    """Judge what happens in this context; a failure on a busy machine is "not judged", with what kept it busy.

    What this process and its children take counts as ours.
    """
    began_s, before = time.monotonic(), _others_s()
    try:
        yield
    except AssertionError as failed:
        after, passed_s = _others_s(), time.monotonic() - began_s
        took = {name: (took_s - before.get(name, 0.0)) / passed_s for name, took_s in after.items()}
        if sum(took.values()) <= _MOST:
            raise
        most = max(took, key=lambda name: took[name])
        share = f"{sum(took.values()):.0%} of a processor went to others, most to {most}"
        pytest.skip(f"not judged: {share}; {str(failed).splitlines()[0]}")


def _others_s() -> dict[str, float]:
    """Return the processor time, in seconds, of each program that is not ours, and of the host."""
    tick_s = 1.0 / os.sysconf("SC_CLK_TCK")
    stats = {int(path.parent.name): stat for path in Path("/proc").glob("[0-9]*/stat") if (stat := _read(path))}
    ours = {os.getpid()}
    while more := {process for process, stat in stats.items() if int(stat[2]) in ours} - ours:
        ours |= more
    others = {f"{stat[0]} ({process})": stat for process, stat in stats.items() if process not in ours}
    stolen = Path("/proc/stat").read_text(encoding="ascii").split()[_STOLEN]
    return {name: tick_s * (int(stat[12]) + int(stat[13])) for name, stat in others.items()} | {
        "the host": tick_s * int(stolen)
    }


def _read(path: Path) -> list[str]:
    """Return a process's name, state, parent and further fields; none for a process that has ended."""
    try:
        before, _, after = path.read_text(encoding="utf-8", errors="replace").rpartition(")")
    except OSError:
        return []
    return [before.partition("(")[2], *after.split()]
