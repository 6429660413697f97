"""Small arrays on the stack, for kernels, which allocate no heap memory."""

import math
from collections.abc import Callable
from typing import Any

import numba
import numba.extending
import numpy as np

from robot_side.compiled.kernel import INT64, as_in_kernels, intrinsic
from robot_side.compiled.numba_inside import array_at, room_on_stack


def on_stack(*shape: int, dtype: Any = np.float64) -> Callable[[], np.ndarray]:
    """Return a function that gives a kernel an uninitialised array of this shape on the stack; in kernels only.

    The array is valid until the function that asked for it returns: never return the array, or a tuple with it. Each
    call in the source code has its own array; in a loop a call gives the same array each time.
    """
    element = np.dtype(dtype)

    @intrinsic(lambda: as_in_kernels(np.empty(shape, element)))
    def array(_typing: Any) -> Any:
        array_type = numba.types.Array(numba.from_dtype(element), len(shape), "C")

        def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            room = room_on_stack(context, builder, array_type.dtype, math.prod(shape))
            count = context.get_value_type(INT64)(shape[0])
            return array_at(context, builder, array_type, room, count, shape[1:])

        return array_type(), generate

    return array
