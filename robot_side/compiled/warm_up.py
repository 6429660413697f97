"""Compiling every kernel beforehand, so that no tick waits for one."""

import os
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from pkgutil import walk_packages
from typing import Final

from common.clock import MonotonicClock
from robot_side.compiled.beside import compile_beside
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.machine_code import can_keep
from robot_side.compiled.sources import code_sizes, digest

NOTEWORTHY_WARM_UP_S = 1.0
"""A person is told about a longer one."""
_WORTH_A_PROCESS: Final = 20_000
"""So many bytes of bytecode take some five seconds, of which a process of its own spends one on its start."""


def warm_up(
    announce: Callable[[], None] | None = None,
    kernels: Sequence[Compiled] | None = None,
    done: Callable[[str], None] = lambda _: None,
) -> float:
    """Compile every kernel of the imported modules, or of `kernels`, or load it from the disk; how long that took (s).

    Without it the first call of each kernel does so, which takes up to seconds. Where there is much to compile, other
    processes do it on as many processors as this one may use; what they cannot is compiled here. `announce` is called
    once, as soon as compiling has taken more than a second, so that a person learns what they wait for; `done` with the
    name of each kernel that has been compiled.
    """
    clock = MonotonicClock()
    start_s = clock.now()
    kernels = imported_kernels() if kernels is None else kernels
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    # Other processes know the kernels of our modules alone.
    missing = [kernel for kernel in kernels if kernel.is_ours and not (kernel.ready or kernel.is_kept)]
    sizes = {part: size for kernel in missing for part, size in code_sizes(kernel.function).items()}
    if processors > 1 and sum(sizes.values()) > _WORTH_A_PROCESS and can_keep():
        if announce is not None:
            announce()
            announce = None
        compile_beside(missing, processors, done)
    compiled = False
    for kernel in kernels:
        kernel.prepare()
        if kernel.cache_hits == 0:
            compiled = True
            done(kernel.name)
        if announce is not None and compiled and clock.now() - start_s > NOTEWORTHY_WARM_UP_S:
            announce()
            announce = None
    return clock.now() - start_s


def import_kernels() -> tuple[Compiled, ...]:
    """Import every module of ours, and so every kernel that some scene may need; all of them."""
    for module in walk_packages(import_module("robot_side").__path__, "robot_side."):
        if module.name.endswith("__main__"):
            continue
        try:
            import_module(module.name)
        except ModuleNotFoundError as error:
            # A library of an extra that this machine lacks: no kernel needs one.
            if error.name is None or find_spec(error.name.partition(".")[0]) is not None:
                raise
    return tuple(kernel for kernel in imported_kernels() if kernel.is_ours)


def kernel_digests() -> dict[str, str]:
    """What every kernel so far is compiled from, digested, by name: equal ones compute the same bits."""
    return {kernel.name: digest(kernel.function)[:16] for kernel in imported_kernels()}
