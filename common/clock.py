"""Clocks. Most other modules do not read a clock, but take the time as an argument (seconds, monotonic)."""

import functools
import time
from pathlib import Path
from typing import Protocol


class Clock(Protocol):
    """Source of the present time, in seconds from an arbitrary origin, which never runs backwards."""

    def now(self) -> float:
        """Return the seconds since this clock's origin."""


class MonotonicClock:
    """Monotonic clock of the machine, which changes of the wall clock do not affect."""

    def now(self) -> float:
        """Return the seconds since an arbitrary origin; on Linux the machine's boot."""
        return time.monotonic()


class ThreadClock:
    """Clock of the processor time that the calling thread has used."""

    def now(self) -> float:
        """Return the seconds of processor time since the thread's start."""
        return time.thread_time()


class VirtualClock:
    """Virtual clock, whose time passes only by `advance_to`; shared by both sides if they run in one process."""

    def __init__(self, now_s: float = 0.0) -> None:
        self._now_s = now_s

    def now(self) -> float:
        """Return the virtual time in seconds."""
        return self._now_s

    def advance_to(self, now_s: float) -> None:
        """Advance to `now_s`; raises ValueError if that is before the present virtual time, or NaN."""
        if not now_s >= self._now_s:
            raise ValueError(f"now_s = {now_s} does not lie at or after the clock's present time {self._now_s}")
        self._now_s = now_s


def wall_clock_offset_s() -> float:
    """Return wall clock minus monotonic clock, in seconds; call once a run, because the wall clock may be set."""
    return time.time() - time.monotonic()


@functools.cache
def clock_domain() -> str:
    """Return a name of the monotonic clock that this process reads; "" if unknown.

    Two processes with the same non-empty name read the same clock: their clock offset is exactly zero, and one-way
    delays need no estimate. The name is made of the kernel's boot identifier and the process's time namespace, which
    can shift the clock.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        namespace = Path("/proc/self/ns/time").readlink()
    except OSError:
        return ""
    return f"{boot} {namespace}"
