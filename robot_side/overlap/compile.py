"""Typed decorators around Numba: `inlined` for building blocks, `compiled` for what Python calls.

Numba is imported untyped; everything else in this package sees ordinary typed functions.
"""

import contextlib
import functools
import hashlib
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numba.extending
from numba.core.caching import FunctionCache
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering

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


def input_indices() -> Any:
    """The Numba type of a C-contiguous int64 array (n,) that the kernel only reads."""
    return numba.types.Array(numba.types.int64, 1, "C", readonly=True)


def output_indices() -> Any:
    """The Numba type of a C-contiguous int64 array (n,) that the kernel fills."""
    return numba.types.Array(numba.types.int64, 1, "C")


NUMBER: Any = numba.types.float64
"""The Numba type of a float."""
TRUTH: Any = numba.types.boolean
"""The Numba type of a bool."""
COUNT: Any = numba.types.int64
"""The Numba type of an int."""


@register_pass(mutates_CFG=False, analysis_only=True)  # type: ignore[no-untyped-call]
class _ForCallers(LoweringPass):
    """What `NativeLowering` leaves out without machine code: making the function known to its callers."""

    _name = "for_callers"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        """Numba knows a compiled function by its entry point, so each gets one that nothing calls."""
        entry_point = object().__reduce_ex__
        state["cr"] = state["cr"]._replace(cfunc=entry_point)
        state.targetctx.insert_user_function(entry_point, state["cr"].fndesc, [state["library"]])
        return True


class _WithoutMachineCode(CompilerBase):
    """Compile to what a kernel needs to link the function in.

    By default Numba also makes machine code of it, and wrappers by which Python and C may call it: more than half
    of the time in all, as nothing but kernels calls these functions.
    """

    def define_pipelines(self) -> list[Any]:
        """The ordinary passes and `_ForCallers`."""
        self.state.flags.no_cpython_wrapper = True
        self.state.flags.no_cfunc_wrapper = True
        self.state.flags.no_compile = True
        passes: Any = DefaultPassBuilder.define_nopython_pipeline(self.state)  # type: ignore[no-untyped-call]
        passes.add_pass_after(_ForCallers, NativeLowering)
        passes.finalize()
        return [passes]


_FOR_CALLERS: dict[str, Any] = {**_OPTIONS, "pipeline_class": _WithoutMachineCode}


def inlined(function: _Function) -> _Function:
    """Compile `function` into whichever kernel calls it."""
    return cast(_Function, numba.njit(forceinline=True, **_FOR_CALLERS)(function))


def building_block(function: _Function) -> _Function:
    """Compile `function` once for the kernels that call it, leaving LLVM to decide about inlining."""
    return cast(_Function, numba.njit(**_FOR_CALLERS)(function))


def _fused_multiply_add(_typing: Any, _a: Any, _b: Any, _c: Any) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return NUMBER(NUMBER, NUMBER, NUMBER), generate


fused_multiply_add: Callable[[float, float, float], float] = cast(Any, numba.extending.intrinsic)(_fused_multiply_add)
"""The product and sum a · b + c with one rounding (IEEE 754-2008, 5.4.1); in kernels only."""


def _power_of_two_below(_typing: Any, _length: Any) -> Any:
    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        integer, double = context.get_value_type(numba.types.int64), context.get_value_type(NUMBER)
        exponent = builder.and_(builder.bitcast(arguments[0], integer), integer(0x7FF0000000000000))
        return builder.bitcast(exponent, double)

    return NUMBER(NUMBER), generate


power_of_two_below: Callable[[float], float] = cast(Any, numba.extending.intrinsic)(_power_of_two_below)
"""The largest power of two that is at most a positive normal float, by its exponent's bits; in kernels only."""

_kernels: list["Compiled"] = []


def imported_kernels() -> tuple["Compiled", ...]:
    """The kernels of every module that has been imported so far."""
    return tuple(_kernels)


class Compiled:
    """A kernel with one signature, compiled (or loaded from the cache on disk) when it is first needed.

    One signature means that no later call can start a compilation: an array of another type, number of
    dimensions or layout raises TypeError instead of stalling a running tick.
    """

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...], returns: Any = None) -> None:
        self.name = f"{function.__module__}.{function.__qualname__}"
        self._dispatcher: Any = numba.njit(**_OPTIONS)(function)
        # Without any writable place for it (a read-only image, say) the kernel works uncached.
        with contextlib.suppress(RuntimeError):
            self._dispatcher._cache = cast(Any, _PackageCache)(function)
        self._signature = (returns or numba.types.void)(*arguments)
        self._preparing = threading.Lock()
        self.ready = False
        """Whether it is compiled, so that the next call takes no longer than any other."""
        _kernels.append(self)

    def prepare(self) -> None:
        """Compile or load now."""
        with self._preparing:
            if not self.ready:
                self._dispatcher.compile(self._signature)
                self._dispatcher.disable_compile()
                self.ready = True

    def __call__(self, *arguments: Any) -> Any:
        """Run the kernel; TypeError for arrays that its signature does not name."""
        if not self.ready:
            self.prepare()
        return self._dispatcher(*arguments)

    @property
    def cache_hits(self) -> int:
        """How often machine code came from the cache on disk: 0 or 1."""
        return sum(self._dispatcher.stats.cache_hits.values())


def compiled(*arguments: Any, returns: Any = None) -> Callable[[Callable[..., Any]], Compiled]:
    """Make a function of these Numba argument types a `Compiled` kernel.

    It fills its output arrays, and returns a value of the type `returns` unless that is None.
    """
    return functools.partial(Compiled, arguments=arguments, returns=returns)


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
    version of a building block from another file. A kernel outside of this package therefore takes its building
    blocks from here or from its own file.
    """

    def _index_key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        key: tuple[Any, ...] = super()._index_key(signature, codegen)  # type: ignore[no-untyped-call]
        return (*key, package_digest())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled kernel, or None where there is none.

        What a damaged file holds (after a crash or a full disk) is thrown away and compiled again.
        """
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:
            # Unpickling may raise anything.
            with contextlib.suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]
            return None
