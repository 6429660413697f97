"""Calls from kernel to kernel by address. For an ordinary call Numba would compile the called kernel again."""

from collections.abc import Callable
from typing import Any

import numba
import numba.extending

from robot_side.compiled.kernel import INT64, imported_kernels, intrinsic
from robot_side.compiled.numba_inside import call_at


def call_at_address(returns: Any, arguments: tuple[Any, ...]) -> Callable[[int, tuple[Any, ...]], Any]:
    """Return a function with which a kernel calls another kernel of these argument and return types.

    It takes the address and a tuple of arguments, and works in kernels only. Arguments of other types raise
    numba.TypingError when the calling kernel is compiled.
    """
    wanted = returns(*arguments)

    def look_up(address: int, given: tuple[Any, ...]) -> Any:
        return next(kernel for kernel in imported_kernels() if kernel.address == address)(*given)

    @intrinsic(look_up)
    def call(_typing: Any, _address: Any, given: Any) -> Any:
        if len(given) != len(wanted.args) or not all(map(_fits, given, wanted.args)):
            raise numba.TypingError(f"the kernel is called with arguments of the types {given}; valid: {wanted.args}")

        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            address, packed = arguments
            unpacked = [builder.extract_value(packed, place) for place in range(len(wanted.args))]
            return call_at(context, builder, wanted, address, unpacked)

        return wanted.return_type(INT64, given), generate

    return call


def _fits(given: Any, wanted: Any) -> bool:
    """Return whether an argument of the type `given` fits: arrays need the same layout, but may differ in read-only."""
    if isinstance(wanted, numba.types.Array):
        of = ("dtype", "ndim", "layout")
        return isinstance(given, numba.types.Array) and all(getattr(given, a) == getattr(wanted, a) for a in of)
    return bool(given == wanted)
