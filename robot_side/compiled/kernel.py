"""Typed decorators around Numba: `compiled` for kernels, which Python calls, and two for the functions that they call.

Numba has no type hints. Through these decorators all other modules see ordinary typed functions.
"""

import contextlib
import functools
import gc
import math
import operator
import threading
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, TypeVar, cast

import numba
import numba.extending
import numpy as np

from robot_side.compiled.machine_code import kept
from robot_side.compiled.numba_inside import (
    ForPython,
    WithoutMachineCode,
    entry_point,
    ignore_constants,
    keep_on_disk,
    machine,
)
from robot_side.compiled.sources import digest

_Function = TypeVar("_Function", bound=Callable[..., Any])

# Division by zero follows IEEE 754 instead of raising, which lets LLVM vectorise. No fastmath flag is set:
# results stay the same from machine to machine and NaN is not assumed away. Without Numba's runtime (_nrt) arrays
# have no reference counts. So a kernel that allocates does not compile; others compile in two thirds of the time.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}


def input_array(dimensions: int) -> Any:
    """Return the Numba type of a C-contiguous float64 array that the kernel only reads.

    Read-only and writable arrays are both accepted, with one compilation.
    """
    return numba.types.Array(numba.types.float64, dimensions, "C", readonly=True)


def output_array(dimensions: int) -> Any:
    """Return the Numba type of a C-contiguous float64 array that the kernel fills."""
    return numba.types.Array(numba.types.float64, dimensions, "C")


def input_indices() -> Any:
    """Return the Numba type of a C-contiguous int64 array (n,) that the kernel only reads."""
    return numba.types.Array(numba.types.int64, 1, "C", readonly=True)


def input_flags() -> Any:
    """Return the Numba type of a C-contiguous array (n,) of bools that the kernel only reads."""
    return numba.types.Array(numba.types.boolean, 1, "C", readonly=True)


def output_indices() -> Any:
    """Return the Numba type of a C-contiguous int64 array (n,) that the kernel fills."""
    return numba.types.Array(numba.types.int64, 1, "C")


def array_of(dtype: Any, dimensions: int, read_only: bool = False) -> Any:
    """Return the Numba type of a C-contiguous array with elements of this NumPy type."""
    return numba.types.Array(numba.from_dtype(np.dtype(dtype)), dimensions, "C", readonly=read_only)


def record_array(dtype: np.dtype) -> Any:
    """Return the Numba type of a contiguous array (n,) of records, which the kernel reads and fills."""
    return numba.types.Array(numba.from_dtype(dtype), 1, "C")


def tuple_type(*parts: Any, named: type | None = None) -> Any:
    """Return the Numba type of a tuple of `parts`, or of the named tuple `named` with these fields.

    A dozen arrays in a tuple are passed as fast as one array.
    """
    return cast(Any, numba.types.BaseTuple).from_types(parts, named)


FLOAT64: Any = numba.types.float64
"""Numba type of a float"""
BOOL: Any = numba.types.boolean
"""Numba type of a bool"""
INT64: Any = numba.types.int64
"""Numba type of an int"""


_FOR_CALLERS: dict[str, Any] = {**_OPTIONS, "pipeline_class": WithoutMachineCode}


JIT: bool = not cast(Any, numba.config).DISABLE_JIT
"""False with NUMBA_DISABLE_JIT=1: kernels are then ordinary functions, which a debugger steps through"""


def intrinsic(plain: _Function) -> Callable[[Callable[..., Any]], _Function]:
    """Return a decorator that makes a function of kernels from one that emits LLVM code (`numba.extending.intrinsic`).

    plain: the same in Python, used without `JIT`.
    """
    return lambda emit: cast(_Function, cast(Any, numba.extending.intrinsic)(emit) if JIT else plain)


def inlined(function: _Function) -> _Function:
    """Compile `function` into each kernel that calls it."""
    if not JIT:
        return function
    return cast(_Function, ignore_constants(numba.njit(forceinline=True, **_FOR_CALLERS)(function)))


def building_block(function: _Function) -> _Function:
    """Compile `function` once for all kernels that call it; LLVM decides whether it is inlined."""
    if not JIT:
        return function
    return cast(_Function, ignore_constants(numba.njit(**_FOR_CALLERS)(function)))


def _rounded_once(a: float, b: float, c: float) -> float:
    return float(Fraction(a) * Fraction(b) + Fraction(c)) if math.isfinite(a + b + c) else a * b + c


@intrinsic(_rounded_once)
def fused_multiply_add(_typing: Any, _a: Any, _b: Any, _c: Any) -> Any:
    """Return a · b + c with a single rounding (IEEE 754-2008, 5.4.1); in kernels only."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return FLOAT64(FLOAT64, FLOAT64, FLOAT64), generate


def _two_to_exponent(length: float) -> float:
    return math.ldexp(1.0, math.frexp(length)[1] - 1)


@intrinsic(_two_to_exponent)
def power_of_two_below(_typing: Any, _length: Any) -> Any:
    """Return the largest power of two at most equal to the argument, a positive normal float; in kernels only."""

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        integer, double = context.get_value_type(numba.types.int64), context.get_value_type(FLOAT64)
        exponent = builder.and_(builder.bitcast(arguments[0], integer), integer(0x7FF0000000000000))
        return builder.bitcast(exponent, double)

    return FLOAT64(FLOAT64), generate


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Switch off the garbage collector for a while: it takes a tenth of a compilation's time and frees little."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


_kernels: list["Compiled"] = []
_told: list[Callable[[str], None]] = []


def as_in_kernels(array: np.ndarray) -> np.ndarray:
    """Return the array; if it has records, one whose records have their fields as attributes."""
    return array.view(np.recarray) if array.dtype.names else array


def imported_kernels() -> tuple["Compiled", ...]:
    """Return the kernels of every module that has been imported so far."""
    return tuple(_kernels)


@contextlib.contextmanager
def late_kernels(told: Callable[[str], None]) -> Iterator[None]:
    """While this is open, call `told` with the name of each kernel that is only now compiled or loaded.

    So a run is told of what holds up one of its turns. If `told` raises an error, the kernel is not prepared.
    """
    _told.append(told)
    try:
        yield
    finally:
        _told.remove(told)


class Compiled:
    """Kernel with a single signature. It is compiled, or loaded from the cache on disk, on first use.

    As there is only one signature, no later call can start a compilation and so stall a running tick. An array of
    another type, number of dimensions or layout raises TypeError.
    """

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...], returns: Any = None) -> None:
        self.name = f"{function.__module__}.{function.__qualname__}"
        self._dispatcher: Any = numba.njit(pipeline_class=ForPython, **_OPTIONS)(function)
        self.function = function
        """Python function from which the kernel is compiled"""
        self.signature = (returns or numba.types.void)(*arguments)
        self._preparing = threading.Lock()
        self.ready = not JIT
        """Whether the kernel is compiled, so that the next call is as fast as any other"""
        self._run: Callable[..., Any] = self._prepare_and_run if JIT else self._interpret
        _kernels.append(self)

    __call__: Any = property(operator.attrgetter("_run"))
    """Run the kernel; TypeError for arrays that do not fit its signature. It is a property because a method that passes
    all arguments on would take longer than some kernels."""

    def prepare(self) -> None:
        """Compile the kernel, or load it from disk, unless that is done already."""
        with self._preparing:
            if not self.ready:
                for told in _told:
                    told(self.name)
                keep_on_disk(self._dispatcher, self.name, self._key())
                with _uncollected():
                    self._dispatcher.compile(self.signature)
                self._dispatcher.disable_compile()
                self._run, self.ready = self._dispatcher, True

    @property
    def is_ours(self) -> bool:
        """Whether another process can find the kernel by its name: a top-level function of `robot_side`"""
        top_level = self.function.__qualname__ == self.function.__name__
        return top_level and self.name.startswith("robot_side.")

    @property
    def is_kept(self) -> bool:
        """Whether the kernel's machine code for this processor is on disk"""
        return not JIT or kept(self.name, self._key()) is not None

    def _key(self) -> str:
        # Computed on first use: only then does every building block exist.
        return f"{machine()} {self.signature} {digest(self.function)}"

    def _prepare_and_run(self, *arguments: Any) -> Any:
        self.prepare()
        return self._dispatcher(*arguments)

    def _interpret(self, *arguments: Any) -> Any:
        """Run the Python function itself. Records have their fields as attributes, as in kernels."""
        return self.function(*(as_in_kernels(one) if isinstance(one, np.ndarray) else one for one in arguments))

    @property
    def address(self) -> int:
        """Address of the kernel's machine code, for `calls.call_at_address`; the kernel is compiled if necessary"""
        if not JIT:
            return id(self)
        if not self.ready:
            self.prepare()
        return entry_point(self._dispatcher, self.signature)

    @property
    def cache_hits(self) -> int:
        """Number of times that the machine code came from the disk: 0 or 1"""
        return sum(self._dispatcher.stats.cache_hits.values()) if JIT else 0


def compiled(*arguments: Any, returns: Any = None) -> Callable[[Callable[..., Any]], Compiled]:
    """Return a decorator that makes a function of these Numba argument types a `Compiled` kernel.

    The kernel fills its output arrays, and returns a value of the type `returns` unless that is None.
    """
    return functools.partial(Compiled, arguments=arguments, returns=returns)
