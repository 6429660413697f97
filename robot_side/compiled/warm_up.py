"""Compilation of all kernels before a run, so that no tick waits for a compilation."""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pkgutil import walk_packages
from typing import Final

from common.clock import MonotonicClock
from common.skipped import Part
from robot_side.compiled.kernel import JIT, Compiled, imported_kernels
from robot_side.compiled.sources import digest

COMPILING: Final = (
    "compiling for this processor, about half a minute at the first start (or beforehand: feelahead doctor --compile)"
)
_NOTEWORTHY_S: Final = 1.0
"""Duration of a compilation after which it is announced"""
_BETWEEN_NOTES_S: Final = 4.0
PROJECTS_KERNELS: Final = 42
"""Number of kernels in all modules of `robot_side`. A run imports those that its scene may need."""


def warm_up(
    announce: Callable[[int, int], None] | None = None,
    kernels: Sequence[Compiled] | None = None,
    done: Callable[[str], None] = lambda _: None,
) -> float:
    """Compile kernels, or load them from disk; return the duration in s. By default: all of the imported modules.

    Without this the first call of each kernel does so, which takes up to seconds. `announce` is called by a thread
    after a second of compilation, and then every 4 s, with the number of compiled kernels and of all that were missing.
    `done` is called with the name of each kernel that has been compiled.
    """
    clock = MonotonicClock()
    start_s = clock.now()
    kernels = imported_kernels() if kernels is None else kernels
    missing = [kernel for kernel in kernels if not (kernel.ready or kernel.is_kept)]
    with _repeated(announce if missing else None, lambda: (sum(one.ready for one in missing), len(missing))):
        for kernel in kernels:
            kernel.prepare()
            if kernel.cache_hits == 0:
                done(kernel.name)
    return clock.now() - start_s


@contextmanager
def _repeated(announce: Callable[[int, int], None] | None, counts: Callable[[], tuple[int, int]]) -> Iterator[None]:
    """Call `announce` with the `counts` a second after the context was opened, and then every 4 s."""
    over = threading.Event()

    def repeat(announce: Callable[[int, int], None]) -> None:
        pause_s = _NOTEWORTHY_S
        while not over.wait(pause_s):
            announce(*counts())
            pause_s = _BETWEEN_NOTES_S

    if announce is not None:
        threading.Thread(target=repeat, args=(announce,), daemon=True).start()
    try:
        yield
    finally:
        over.set()


def import_kernels() -> tuple[Compiled, ...]:
    """Import every module of `robot_side`, and so all kernels that a scene may need. Return these kernels."""
    for module in walk_packages(import_module("robot_side").__path__, "robot_side."):
        if module.name.endswith("__main__"):
            continue
        try:
            import_module(module.name)
        except ModuleNotFoundError as error:
            # Missing libraries of extras do not matter: no kernel needs one.
            if error.name is None or find_spec(error.name.partition(".")[0]) is not None:
                raise
    return tuple(kernel for kernel in imported_kernels() if kernel.is_ours)


def kernels_compiled() -> Part:
    """Return how many of the project's kernels this process has compiled or loaded; of 0 without Numba's compiler."""
    return Part(sum(one.ready and one.is_ours for one in imported_kernels()), PROJECTS_KERNELS if JIT else 0)


def kernel_digests() -> dict[str, str]:
    """Return a digest of each imported kernel's sources, keyed by name. Equal digests compute the same bits."""
    return {kernel.name: digest(kernel.function)[:16] for kernel in imported_kernels()}
