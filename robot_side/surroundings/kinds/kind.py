"""Descriptor of a kind of primitive; every list of kinds follows from the descriptors.

A kind is one file with one `KIND`, named once in `perceived.KINDS`; its arrays are fields of `PerceivedObjects`.
Kernels cannot choose from a list of functions, so `by_kind` builds an if-chain of nested closures, whose types are
`Any`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import Compiled, inlined
from robot_side.surroundings.kinds.layout import NUMBERS, rows

Row = tuple[int, ...]
"""Shape of one row of an array"""


class Check(Enum):
    """Condition that all numbers of an array meet, besides being finite."""

    FINITE = auto()
    NOT_NEGATIVE = auto()
    UNIT = auto()
    ORTHONORMAL = auto()
    INDEX = auto()


class Array(NamedTuple):
    """Array of a frame with a row for each primitive of a kind."""

    name: str
    row: Row
    check: Check = Check.FINITE

    @property
    def type(self) -> type:
        """Type of the values"""
        return np.int64 if self.check is Check.INDEX else np.float64


class Placed(NamedTuple):
    """Primitives in the world."""

    shapes: FloatArray
    """(k, 15) numbers of the shape"""
    bounds: FloatArray
    """(k, 4) centre and radius of a sphere around each primitive"""
    volumes_m3: FloatArray
    """(k,)"""


@dataclass(frozen=True, eq=False)
class Kind:
    """Kind of primitive.

    In shapes, k is the number of its primitives; the columns are the arrays that `read` returns.
    """

    name: str
    arrays: tuple[Array, ...]
    """Arrays of a frame with the poses and sizes of this kind's primitives"""
    placed: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    """Function (sizes (k, 20), positions (k, 3), rotations (k, 3, 3)) that returns the numbers (k, 20) of primitives
    with these sizes at these poses"""
    place: Callable[[FloatArray], "Placed"]
    """Function (numbers (k, 20)) that returns shapes, bounds and volumes"""
    nearest: Callable[..., Any]
    """Function (shapes (n, 15), row, point) that returns a Nearest. It is compiled, as are all functions below."""
    contact: Callable[..., Any]
    """Function (shapes (n, 15), row, start, radius, along, reach) that returns a Contact"""
    chord: Callable[..., Any]
    """Function (shapes (n, 15), row, start, along) that returns a Chord"""
    overlap: Callable[..., Any] | None = None
    """Function (shapes (n, 15), row, center, radius) that returns an Overlap; None if only `kernel` computes it"""
    kernel: Compiled | None = None
    """Overlap kernel with the argument types OVERLAP; None if `overlap` is given. A scene loads only the kernels of its
    own kinds."""
    in_box: bool = False
    """Whether the columns give each primitive's bounding box: centres (k, 3), rotations (k, 3, 3), half sizes (k, 3)"""
    derive: Callable[[Any], tuple[Any, ...]] | None = None
    """Function of a frame that returns the columns; None if the columns are the arrays"""
    more: Callable[[Any], FloatArray] | None = None
    """Function of a frame that returns further numbers of each primitive, which follow those of the arrays"""

    @cached_property
    def owner(self) -> str:
        """Name of the frame's field with the index of each primitive's object"""
        return f"{self.name}_object"

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Names of the arrays whose values may change from frame to frame: all but indices"""
        return tuple(array.name for array in self.arrays if array.check is not Check.INDEX)

    @cached_property
    def parts(self) -> Mapping[str, tuple[slice, Row]]:
        """For each array of `fields`: slice of its values in a primitive's numbers, and shape of one of its rows"""
        found, end = {}, 0
        for array in self.arrays:
            if array.check is not Check.INDEX:
                found[array.name] = slice(end, end + math.prod(array.row)), array.row
                end += math.prod(array.row)
        return found

    def numbers(self, objects: Any) -> FloatArray:
        """Return the numbers (k, 20) of this kind's primitives in a frame."""
        further = () if self.more is None else (self.more(objects),)
        return rows(*(getattr(objects, name) for name in self.fields), *further, width=NUMBERS)

    def read(self, objects: Any) -> tuple[Any, ...]:
        """Return the columns of this kind's primitives in a frame."""
        return self.derive(objects) if self.derive else tuple([getattr(objects, name) for name in self.fields])


def by_kind(functions: Sequence[Callable[..., Any]], first: int = 0) -> Any:
    """Return a function (kind, *arguments) that calls the function for the number `kind`; the first's is `first`.

    Any other number calls the last function.
    """
    function, *others = functions
    if not others:

        @inlined
        def last(_kind: int, *arguments: Any) -> Any:
            return function(*arguments)

        return last
    rest = by_kind(others, first + 1)

    @inlined
    def chosen(kind: int, *arguments: Any) -> Any:
        if kind == first:
            return function(*arguments)
        return rest(kind, *arguments)

    return chosen
