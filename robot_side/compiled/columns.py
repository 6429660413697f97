"""Bundles: many arrays that go to a kernel as one argument, a table of their addresses and lengths.

The arrays are declared once for Python and kernels. Passing one argument costs a fifth of passing twenty.
"""

import ctypes
import math
from collections.abc import Callable
from typing import Any, Final, Generic, NamedTuple, TypeVar, cast

import numba
import numba.extending
import numpy as np

from common.arrays import IntArray
from robot_side.compiled.kernel import as_in_kernels, intrinsic
from robot_side.compiled.numba_inside import array_at, elements_of

_Columns = TypeVar("_Columns", bound=tuple[Any, ...])

BUNDLE: Final = numba.types.Array(numba.types.int64, 2, "C", readonly=True)
"""Numba type of `Declared.bundle`"""


class Form(NamedTuple):
    """Type of a bundled array: its shape is (n, *inner), its elements have the type `dtype`."""

    dtype: np.dtype
    inner: tuple[int, ...] = ()


NUMBERS: Final = Form(np.dtype(np.float64))
"""Form of an array (n,) of floats"""
INDICES: Final = Form(np.dtype(np.int64))
"""Form of an array (n,) of int64"""
FLAGS: Final = Form(np.dtype(np.bool_))
"""Form of an array (n,) of bools"""
BUNDLED: Final = Form(np.dtype(np.int64), (2,))
"""Form of another bundle (n, 2)"""


def rows(width: int) -> Form:
    """Return the form of an array (n, width) of floats."""
    return Form(NUMBERS.dtype, (width,))


def matrices(height: int, width: int) -> Form:
    """Return the form of an array (n, height, width) of floats."""
    return Form(NUMBERS.dtype, (height, width))


def records(dtype: Any) -> Form:
    """Return the form of an array (n,) of records of the type `dtype`."""
    return Form(dtype)


class Declared(Generic[_Columns]):
    """Declaration of a bundle: a named tuple type whose fields are arrays, and the form of each array."""

    def __init__(self, columns: type[_Columns], *forms: Form) -> None:
        """columns: the named tuple type. forms: the form of each of its fields, in order.

        TypeError unless there are as many forms as fields.
        """
        self._fields: tuple[str, ...] = cast(Any, columns)._fields
        if len(forms) != len(self._fields):
            raise TypeError(f"{columns.__name__} has {len(self._fields)} columns; {len(forms)} forms are given")
        self._forms = forms
        self.at: Callable[[IntArray], _Columns] = _view(columns, forms)
        """Function that returns the named tuple of arrays for a bundle; in kernels only"""

    def empty(self, count: int) -> list[np.ndarray]:
        """Return an array of `count` rows, filled with 0, for each field."""
        return [np.zeros((count, *form.inner), dtype=form.dtype) for form in self._forms]

    def bundle(self, owner: object) -> IntArray:
        """Return the bundle (n, 2): address and number of rows of each of the owner's arrays named like the fields.

        The owner must keep these arrays alive. ValueError for an array that is not C-contiguous, not aligned, or of
        another form than declared.
        """
        arrays = [getattr(owner, name) for name in self._fields]
        for name, array, form in zip(self._fields, arrays, self._forms, strict=True):
            fits = array.flags.c_contiguous and array.flags.aligned
            if not fits or array.dtype != form.dtype or array.shape[1:] != form.inner:
                raise ValueError(
                    f"{name}: {array.dtype} {array.shape} with steps {array.strides} cannot be bundled;"
                    f" valid: C-contiguous, aligned {form.dtype} ({', '.join(('n', *map(str, form.inner)))})"
                )
        return np.array([(array.__array_interface__["data"][0], len(array)) for array in arrays], dtype=np.int64)


def _view(columns: Any, forms: tuple[Form, ...]) -> Any:
    # One intrinsic for all arrays: one call per array would take longer to compile than the code that uses them.
    def read(bundle: IntArray) -> Any:
        return columns(*(_array(form, *row) for form, row in zip(forms, bundle.tolist(), strict=True)))

    @intrinsic(read)
    def at(_typing: Any, bundle: Any) -> Any:
        arrays = [numba.types.Array(numba.from_dtype(form.dtype), 1 + len(form.inner), "C") for form in forms]
        tuple_type = cast(Any, numba.types.BaseTuple).from_types(arrays, columns)

        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            elements = elements_of(context, builder, bundle, arguments[0], 2 * len(forms))
            values = []
            for array, form, address, length in zip(arrays, forms, elements[::2], elements[1::2], strict=True):
                pointer = builder.inttoptr(address, context.get_value_type(numba.types.voidptr))
                values.append(array_at(context, builder, array, pointer, length, form.inner))
            return context.make_tuple(builder, tuple_type, values)

        return tuple_type(BUNDLE), generate

    return at


def _array(form: Form, address: int, length: int) -> np.ndarray:
    """Return the array of this form at an address."""
    shape = length, *form.inner
    memory = (ctypes.c_char * (math.prod(shape) * form.dtype.itemsize)).from_address(address)
    return as_in_kernels(np.ndarray(shape, form.dtype, cast(Any, memory)))
