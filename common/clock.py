"""The only place that reads a clock: everything else takes `now` (seconds, monotonic) as an argument."""

import functools
import time
from pathlib import Path
from typing import Protocol


class Clock(Protocol):
    """A source of `now`, in seconds from an origin of its own, that never runs backwards."""

    def now(self) -> float:
        """Seconds since this clock's origin."""


class MonotonicClock:
    """The machine's monotonic clock: untouched by changes of the wall clock."""

    def now(self) -> float:
        """Seconds since the machine's boot, on Linux."""
        return time.monotonic()


class ThreadClock:
    """What this thread has computed: it stands still while the machine does something else."""

    def now(self) -> float:
        """Seconds of processor time since the thread's start."""
        return time.thread_time()


class VirtualClock:
    """A clock that stands still until it is told otherwise, for both sides in one process."""

    def __init__(self, now_s: float = 0.0) -> None:
        self._now_s = now_s

    def now(self) -> float:
        """Seconds since the origin that the constructor was given."""
        return self._now_s

    def advance_to(self, now_s: float) -> None:
        """Move on to `now_s`; ValueError when that lies in the past or is no number."""
        if not now_s >= self._now_s:
            raise ValueError(f"now_s = {now_s} does not lie at or after the clock's present time {self._now_s}")
        self._now_s = now_s


def wall_clock_offset_s() -> float:
    """What the wall clock is ahead of the monotonic one now: to be read once, as people set the wall clock."""
    return time.time() - time.monotonic()


@functools.cache
def clock_domain() -> str:
    """Name the monotonic clock that this process reads, or "" where that is not known.

    Two processes with the same non-empty name read the very same clock, so that their stamps differ by an
    offset of exactly zero and one-way delays need no estimate. The name is the kernel's boot identifier
    with the process's time namespace, which can shift the clock.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        namespace = Path("/proc/self/ns/time").readlink()
    except OSError:
        return ""
    return f"{boot} {namespace}"
