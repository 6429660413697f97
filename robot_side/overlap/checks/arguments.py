"""Checks of the public functions' arguments, and their broadcasting against each other."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from types import EllipsisType

import numpy as np
import numpy.typing as npt

from common.arrays import BoolArray, FloatArray

LARGEST = 1e50
"""Largest magnitude of any coordinate or length, in m, so that products of six such numbers stay finite"""

SMALLEST_NORMAL = 1e-50
"""Smallest valid length of a half-space's normal"""

ORTHONORMALITY = 1e-6
"""Largest valid Frobenius norm of QᵀQ - I for a rotation matrix Q"""

Index = tuple[int | slice, ...] | EllipsisType
"""Part of an array's leading dimensions"""


@dataclass(frozen=True)
class Argument:
    """Checked argument: an array whose last dimensions `trailing` are those of one item, such as (3,) of a centre."""

    name: str
    values: FloatArray
    trailing: tuple[int, ...]

    @property
    def leading(self) -> tuple[int, ...]:
        """Dimensions before `trailing`, which broadcast with those of other arguments"""
        return self.values.shape[: self.values.ndim - len(self.trailing)]

    @property
    def items(self) -> FloatArray:
        """All items in one contiguous array (number of items, *trailing)"""
        return np.ascontiguousarray(self.values).reshape(-1, *self.trailing)

    def refuse_any(self, wrong: BoolArray, shape: tuple[int, ...], what_is_valid: str) -> None:
        """Raise a ValueError that names the first item or number that is wrong, unless none is.

        wrong: a flag for each item or number. shape: their dimensions, from which the index in the message follows.
        """
        if not wrong.any():
            return
        index = tuple(int(place) for place in np.unravel_index(wrong.argmax(), shape))
        label = self.name + (f"[{', '.join(map(str, index))}]" if index else "")
        raise ValueError(f"{label} = {self.values[index].tolist()} is out of range; valid: {what_is_valid}")

    def rows(self, shape: tuple[int, ...]) -> FloatArray:
        """Return the items broadcast to the leading dimensions `shape`, in one contiguous array (items, *trailing)."""
        return self.items if self.leading == shape else self.block(shape, ...).items

    def block(self, shape: tuple[int, ...], block: Index) -> "Argument":
        """Return the part `block` of this argument as broadcast to the leading dimensions `shape`; copies nothing."""
        return replace(self, values=np.broadcast_to(self.values, (*shape, *self.trailing))[block])


Check = Callable[[str, npt.ArrayLike, tuple[int, ...]], Argument]
"""Function (name, value, trailing dimensions) that checks an argument and returns it; ValueError for a wrong one"""

_FLOAT64 = np.dtype(np.float64)


def plain_rows(
    values: Sequence[npt.ArrayLike], trailing: Sequence[tuple[int, ...]]
) -> tuple[list[FloatArray], tuple[int, ...]] | None:
    """Return the items of each argument and the common leading dimensions, if nothing needs to be converted.

    That is so for contiguous float64 arrays with equal leading dimensions. Return None for any other arguments.
    """
    try:
        arrays = [np.asarray(value) for value in values]
    except ValueError:
        return None
    leading = arrays[0].shape[:-1]
    for array, last in zip(arrays, trailing, strict=True):
        if array.dtype != _FLOAT64 or array.shape != leading + last or not array.flags.c_contiguous:
            return None
    if len(leading) == 1:
        return arrays, leading
    return [array.reshape(-1, *last) for array, last in zip(arrays, trailing, strict=True)], leading


def numbers(name: str, value: npt.ArrayLike, trailing: tuple[int, ...] = ()) -> Argument:
    """Return `value` as finite float64 numbers with the last dimensions `trailing`, or raise a ValueError."""
    return _within(name, value, trailing, -LARGEST, f"finite, magnitude at most {LARGEST:g}")


def lengths(name: str, value: npt.ArrayLike, trailing: tuple[int, ...] = ()) -> Argument:
    """Return `value` as `numbers` does, or raise a ValueError if one is negative."""
    return _within(name, value, trailing, 0.0, f"finite, 0 to {LARGEST:g} m")


def directions(name: str, value: npt.ArrayLike, trailing: tuple[int, ...] = (3,)) -> Argument:
    """Return `value` (..., 3) as `numbers` does, or raise a ValueError if a vector is shorter than SMALLEST_NORMAL."""
    argument = numbers(name, value, trailing)
    short = np.hypot(np.hypot(*argument.items.T[:2]), argument.items[:, 2]) < SMALLEST_NORMAL
    argument.refuse_any(short, argument.leading, f"a vector of length {SMALLEST_NORMAL:g} or more")
    return argument


def rotations(name: str, value: npt.ArrayLike, trailing: tuple[int, ...] = (3, 3)) -> Argument:
    """Return `value` (..., 3, 3) as `numbers` does, or raise a ValueError if a matrix is not orthonormal."""
    argument = numbers(name, value, trailing)
    excess = argument.items.swapaxes(1, 2) @ argument.items - np.eye(3)
    skewed = (excess * excess).sum(axis=(1, 2)) > ORTHONORMALITY**2
    argument.refuse_any(skewed, argument.leading, f"an orthonormal matrix Q, ‖QᵀQ - I‖ <= {ORTHONORMALITY:g}")
    return argument


def _within(name: str, value: npt.ArrayLike, trailing: tuple[int, ...], lowest: float, what_is_valid: str) -> Argument:
    try:
        raw = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name} is no rectangular array; valid: {_shape_text(trailing)}") from error
    if raw.dtype.kind not in "iuf":
        raise ValueError(f"{name} has the type {raw.dtype}; valid: real numbers")
    values = raw.astype(np.float64, copy=False)
    if values.ndim < len(trailing) or values.shape[values.ndim - len(trailing) :] != trailing:
        raise ValueError(f"{name} has the shape {values.shape}; valid: {_shape_text(trailing)}")
    argument = Argument(name, values, trailing)
    # In this form of the comparison NaN is outside, too.
    argument.refuse_any(~((values >= lowest) & (values <= LARGEST)), values.shape, what_is_valid)
    return argument


def broadcast(arguments: Sequence[Argument]) -> tuple[int, ...]:
    """Return the common leading dimensions of the arguments, or raise a ValueError."""
    first = arguments[0].leading
    if all(argument.leading == first for argument in arguments):
        return first
    try:
        return np.broadcast_shapes(*(argument.leading for argument in arguments))
    except ValueError as error:
        shapes = ", ".join(f"{argument.name} {argument.values.shape}" for argument in arguments)
        raise ValueError(
            f"the arguments' leading dimensions do not broadcast: {shapes}; valid: equal ones, or 1"
        ) from error


def blocks(shape: tuple[int, ...], most: int) -> Iterator[tuple[int | slice, ...]]:
    """Yield the parts of an array of `shape` that together are the whole, each of at most `most` >= 1 numbers."""
    axis = next(i for i in range(len(shape)) if math.prod(shape[i + 1 :]) <= most)
    step = most // max(math.prod(shape[axis + 1 :]), 1)
    for outer in np.ndindex(shape[:axis]):
        for first in range(0, shape[axis], step):
            yield (*outer, slice(first, first + step))


def _shape_text(trailing: tuple[int, ...]) -> str:
    return f"the shape ({', '.join(['...', *map(str, trailing)])})"
