"""Clocks; all other modules take `now` (seconds, monotonic) as an argument."""

import functools
import time
from pathlib import Path
from typing import Protocol


class Clock(Protocol):
    """Source of `now`, in seconds from some origin, that never runs backwards."""

    def now(self) -> float:
        """Return the seconds since this clock's origin."""


class MonotonicClock:
    """Monotonic clock of the machine: independent of changes of the wall clock."""

    def now(self) -> float:
        """Return the seconds since the machine's boot, on Linux."""
        return time.monotonic()


class ThreadClock:
    """Processor time of the calling thread."""

    def now(self) -> float:
        """Return the seconds of processor time since the thread's start."""
        return time.thread_time()


class VirtualClock:
    """Virtual clock: time passes only by `advance_to`. Both sides of one process share it."""

    def __init__(self, now_s: float = 0.0) -> None:
        self._now_s = now_s

    def now(self) -> float:
        """Return the virtual time in seconds."""
        return self._now_s

    def advance_to(self, now_s: float) -> None:
        """Advance to `now_s`; raises ValueError for the past and for NaN."""
        if not now_s >= self._now_s:
            raise ValueError(f"now_s = {now_s} does not lie at or after the clock's present time {self._now_s}")
        self._now_s = now_s


def wall_clock_offset_s() -> float:
    """Return wall clock minus monotonic clock; read it once, because people set the wall clock."""
    return time.time() - time.monotonic()


@functools.cache
def clock_domain() -> str:
    """Name this process's monotonic clock, or return "" if it is unknown.

    Two processes with the same non-empty name read the same clock: their offset is exactly zero, and one-way delays
    need no estimate. The name is the kernel's boot identifier with the process's time namespace, which can shift the
    clock.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        namespace = Path("/proc/self/ns/time").readlink()
    except OSError:
        return ""
    return f"{boot} {namespace}"
