"""Compiling every kernel beforehand, so that no tick waits for one."""

from collections.abc import Callable

from common.clock import MonotonicClock
from robot_side.compiled.kernel import imported_kernels
from robot_side.compiled.sources import digest

NOTEWORTHY_WARM_UP_S = 1.0
"""A person is told about a longer one."""


def warm_up(announce: Callable[[], None] | None = None) -> float:
    """Compile every kernel of the imported modules, or load it from the cache on disk; how long that took (s).

    Without it the first call of each kernel does so, which takes up to seconds. `announce` is called once, as soon as
    compiling has taken more than a second, so that a person learns what they wait for.
    """
    clock = MonotonicClock()
    start_s = clock.now()
    compiled = False
    for kernel in imported_kernels():
        kernel.prepare()
        compiled |= kernel.cache_hits == 0
        if announce is not None and compiled and clock.now() - start_s > NOTEWORTHY_WARM_UP_S:
            announce()
            announce = None
    return clock.now() - start_s


def kernel_digests() -> dict[str, str]:
    """What every kernel so far is compiled from, digested, by name: equal ones compute the same bits."""
    return {kernel.name: digest(kernel.function)[:16] for kernel in imported_kernels()}
