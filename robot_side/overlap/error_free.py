"""Sums and products of two doubles together with what rounding took from them (Knuth; Dekker)."""

from typing import Any

from numba import types
from numba.extending import intrinsic

from robot_side.overlap.compile import inlined


@intrinsic  # type: ignore[untyped-decorator]
def fused_multiply_add(_typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """a·b + c, rounded once: an instruction where the processor has one, else the C library's function."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    del a, b, c
    return types.float64(types.float64, types.float64, types.float64), generate


@inlined
def two_sum(a: float, b: float) -> tuple[float, float]:
    """(rounded a + b, error), which together are a + b exactly."""
    total = a + b
    of_b = total - a
    return total, (a - (total - of_b)) + (b - of_b)


@inlined
def two_product(a: float, b: float) -> tuple[float, float]:
    """(rounded a·b, error), which together are a·b exactly unless that underflows."""
    product = a * b
    return product, fused_multiply_add(a, b, -product)
