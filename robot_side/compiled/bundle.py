"""Arrays that go to a kernel together, by their addresses: one argument costs a fifth of what twenty do."""

from typing import Any, Final, cast

import numba
import numba.extending
import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.kernel import COUNT, inlined

BUNDLE: Final = numba.types.Array(numba.types.int64, 2, "C", readonly=True)
"""The Numba type of `addresses`."""


def addresses(*arrays: np.ndarray) -> IntArray:
    """Address and number of rows (n, 2) of C-contiguous arrays; whoever keeps it must keep them, too.

    ValueError for an array with gaps between its rows.
    """
    for array in arrays:
        if not array.flags.c_contiguous:
            raise ValueError(f"an array of steps {array.strides} cannot be bundled; valid: C-contiguous ones")
    return np.array([(array.__array_interface__["data"][0], len(array)) for array in arrays], dtype=np.int64)


def _at(_typing: Any, _address: Any) -> Any:
    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(numba.types.voidptr))

    return numba.types.voidptr(COUNT), generate


_pointer: Any = cast(Any, numba.extending.intrinsic)(_at)
_view: Any = cast(Any, numba).carray


@inlined
def numbers(bundle: IntArray, place: int) -> FloatArray:
    """The array (n,) of floats at a place of the bundle; in kernels only, as all of these."""
    found: FloatArray = _view(_pointer(bundle[place, 0]), (bundle[place, 1],), np.float64)
    return found


@inlined
def rows(bundle: IntArray, place: int, width: int) -> FloatArray:
    """The array (n, width) of floats."""
    found: FloatArray = _view(_pointer(bundle[place, 0]), (bundle[place, 1], width), np.float64)
    return found


@inlined
def matrices(bundle: IntArray, place: int, height: int, width: int) -> FloatArray:
    """The array (n, height, width) of floats."""
    found: FloatArray = _view(_pointer(bundle[place, 0]), (bundle[place, 1], height, width), np.float64)
    return found


@inlined
def indices(bundle: IntArray, place: int) -> IntArray:
    """The array (n,) of int64."""
    found: IntArray = _view(_pointer(bundle[place, 0]), (bundle[place, 1],), np.int64)
    return found


@inlined
def bundled(bundle: IntArray, place: int) -> IntArray:
    """The array (n, 2) of int64: another bundle."""
    found: IntArray = _view(_pointer(bundle[place, 0]), (bundle[place, 1], 2), np.int64)
    return found


@inlined
def flags(bundle: IntArray, place: int) -> BoolArray:
    """The array (n,) of bools."""
    found: BoolArray = _view(_pointer(bundle[place, 0]), (bundle[place, 1],), np.bool_)
    return found


@inlined
def records(bundle: IntArray, place: int, dtype: np.dtype) -> np.ndarray:
    """The array (n,) of records of `dtype`."""
    found: np.ndarray = _view(_pointer(bundle[place, 0]), (bundle[place, 1],), dtype)
    return found
