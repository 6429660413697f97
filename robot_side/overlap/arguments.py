"""Checks of the public functions' arguments, and their broadcasting against each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from common.arrays import BoolArray, FloatArray

LARGEST = 1e50
"""The largest magnitude of any coordinate or length (m): products of six of them stay finite."""

SMALLEST_NORMAL = 1e-50
"""The shortest normal of a half-space."""

ORTHONORMALITY = 1e-6
"""The largest Frobenius norm of QᵀQ - I of a rotation Q."""


@dataclass(frozen=True)
class Argument:
    """An argument that has been checked: every row of the last `trailing` dimensions is one item."""

    name: str
    values: FloatArray
    trailing: tuple[int, ...]

    @property
    def leading(self) -> tuple[int, ...]:
        """The dimensions that broadcast."""
        return self.values.shape[: self.values.ndim - len(self.trailing)]

    def require(self, valid: BoolArray, what_is_valid: str) -> None:
        """ValueError about the first item or number for which `valid`, a mask over leading indices, is False."""
        if valid.all():
            return
        index = tuple(int(i) for i in np.argwhere(~valid)[0])
        label = self.name + (f"[{', '.join(map(str, index))}]" if index else "")
        raise ValueError(f"{label} = {self.values[index].tolist()} is out of range; valid: {what_is_valid}")

    def rows(self, shape: tuple[int, ...]) -> FloatArray:
        """The items repeated to the leading dimensions `shape`, flattened to (items, *trailing), contiguous."""
        repeated = np.broadcast_to(self.values, (*shape, *self.trailing))
        return np.ascontiguousarray(repeated).reshape(int(np.prod(shape, dtype=np.int64)), *self.trailing)


def numbers(name: str, value: npt.ArrayLike, trailing: tuple[int, ...] = ()) -> Argument:
    """`value` as finite float64 with the last dimensions `trailing`, or ValueError."""
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
    # NaN compares false, so that it fails as well.
    argument.require(np.less_equal(np.abs(values), LARGEST), f"finite, magnitude at most {LARGEST:g}")
    return argument


def lengths(name: str, value: npt.ArrayLike, trailing: tuple[int, ...] = ()) -> Argument:
    """`numbers` that are not negative."""
    argument = numbers(name, value, trailing)
    argument.require(np.greater_equal(argument.values, 0.0), f"0 to {LARGEST:g} m")
    return argument


def directions(name: str, value: npt.ArrayLike) -> Argument:
    """`numbers` (..., 3) of which no vector is 0."""
    argument = numbers(name, value, (3,))
    long_enough = np.greater_equal(np.linalg.norm(argument.values, axis=-1), SMALLEST_NORMAL)
    argument.require(long_enough, f"a vector of length {SMALLEST_NORMAL:g} or more")
    return argument


def rotations(name: str, value: npt.ArrayLike) -> Argument:
    """`numbers` (..., 3, 3) of which every matrix is orthonormal."""
    argument = numbers(name, value, (3, 3))
    excess = np.swapaxes(argument.values, -1, -2) @ argument.values - np.eye(3)
    orthonormal = np.less_equal(np.linalg.norm(excess, axis=(-2, -1)), ORTHONORMALITY)
    argument.require(orthonormal, f"an orthonormal matrix Q, ‖QᵀQ - I‖ <= {ORTHONORMALITY:g}")
    return argument


def broadcast(arguments: Sequence[Argument]) -> tuple[int, ...]:
    """The common leading dimensions of the arguments, or ValueError."""
    try:
        return np.broadcast_shapes(*(argument.leading for argument in arguments))
    except ValueError as error:
        shapes = ", ".join(f"{argument.name} {argument.values.shape}" for argument in arguments)
        raise ValueError(f"the leading dimensions do not broadcast: {shapes}") from error


def _shape_text(trailing: tuple[int, ...]) -> str:
    return f"the shape ({', '.join(['...', *map(str, trailing)])})"
