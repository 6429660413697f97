"""Typed decorators around Numba: `inlined` for building blocks, `compiled` for what Python calls.

Numba is imported untyped; everything else in this package sees ordinary typed functions.
"""

import contextlib
import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache

_Function = TypeVar("_Function", bound=Callable[..., Any])

# Division by zero follows IEEE 754 instead of raising, which lets LLVM vectorise. No fastmath flag is set:
# results stay the same from machine to machine and NaN is not assumed away.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}


def input_array(dimensions: int) -> Any:
    """The Numba type of a C-contiguous float64 array that the kernel only reads.

    Read-only and writable arrays are both accepted, so that neither brings a compilation of its own.
    """
    return numba.types.Array(numba.types.float64, dimensions, "C", readonly=True)


def output_array(dimensions: int) -> Any:
    """The Numba type of a C-contiguous float64 array that the kernel fills."""
    return numba.types.Array(numba.types.float64, dimensions, "C")


def inlined(function: _Function) -> _Function:
    """Compile `function` into whichever kernel calls it."""
    return cast(_Function, numba.njit(forceinline=True, **_OPTIONS)(function))


def building_block(function: _Function) -> _Function:
    """Compile `function` once for the kernels that call it, leaving LLVM to decide about inlining."""
    return cast(_Function, numba.njit(**_OPTIONS)(function))


class Compiled:
    """A kernel with one signature, compiled (or loaded from the cache on disk) when it is first needed.

    One signature means that no later call can start a compilation: an array of another type, number of
    dimensions or layout raises TypeError instead of stalling a running tick.
    """

    def __init__(self, function: Callable[..., None], arguments: tuple[Any, ...]) -> None:
        self._dispatcher: Any = numba.njit(**_OPTIONS)(function)
        # Without any writable place for it (a read-only image, say) the kernel works uncached.
        with contextlib.suppress(RuntimeError):
            self._dispatcher._cache = cast(Any, _PackageCache)(function)
        self._signature = numba.types.void(*arguments)
        self.ready = False
        """Whether it is compiled, so that the next call takes no longer than any other."""

    def prepare(self) -> None:
        """Compile or load now."""
        if not self.ready:
            self._dispatcher.compile(self._signature)
            self._dispatcher.disable_compile()
            self.ready = True

    def __call__(self, *arguments: Any) -> None:
        """Run the kernel; TypeError for arrays that its signature does not name."""
        if not self.ready:
            self.prepare()
        self._dispatcher(*arguments)

    @property
    def cache_hits(self) -> int:
        """How often machine code came from the cache on disk: 0 or 1."""
        return sum(self._dispatcher.stats.cache_hits.values())


def compiled(*arguments: Any) -> Callable[[Callable[..., None]], Compiled]:
    """Make a function of these Numba argument types, which fills its output arrays, a `Compiled` kernel."""
    return functools.partial(Compiled, arguments=arguments)


@functools.cache
def package_digest() -> str:
    """A digest of every source file of this package."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


class _PackageCache(FunctionCache):
    """Numba's cache on disk, with the whole package in its key.

    Numba by itself looks only at the file of the kernel, and would go on running machine code with an old
    version of a building block from another file.
    """

    def _index_key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        key: tuple[Any, ...] = super()._index_key(signature, codegen)  # type: ignore[no-untyped-call]
        return (*key, package_digest())
