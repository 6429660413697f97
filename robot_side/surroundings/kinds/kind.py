"""Descriptor of a kind of primitive; every list of kinds follows from the descriptors.

The rule: a kind is one file with one `KIND`, named once in `perceived.KINDS` beside its arrays. The regret: a kernel
takes no list of arrays, so `by_kind` builds an if-chain of nested closures, and types end at `Any`.
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
"""Shape of an array's rows"""


class Check(Enum):
    """Condition on the numbers of an array, besides that they are finite."""

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


@dataclass(frozen=True, eq=False)
class Kind:
    """Kind of primitive; k counts its primitives, `columns` are the arrays that `read` returns."""

    name: str
    arrays: tuple[Array, ...]
    """Arrays of poses and sizes"""
    placed: Callable[..., None]
    """(sizes (k, 20), k, position, turns (g, 9), turn, numbers (n, 20), row): write the numbers of a primitive of these
    sizes, given in its own frame, at this pose. Compiled, as all below."""
    place: Callable[..., float]
    """(numbers, k, bounds (n, 4), row) to the volume in m³: convert the numbers to the shape, and write the bounds"""
    nearest: Callable[..., Any]
    """(shapes (n, 15), row, point) to Nearest"""
    contact: Callable[..., Any]
    """(shapes (n, 15), row, start, radius, along, reach) to Contact"""
    overlap: Callable[..., Any] | None = None
    """(shapes (n, 15), row, center, radius) to Overlap, if the closed form is short; else `kernel` computes it"""
    kernel: Compiled | None = None
    """Overlap kernel with the signature OVERLAP; a scene loads only those of its own kinds"""
    centers: Callable[..., Any] | None = None
    """(columns) to centres (k, 3) in metres; None for an infinite kind"""
    in_box: bool = False
    """Whether the columns are a bounding box: centres (k, 3), rotations (k, 3, 3), half sizes (k, 3)"""
    derive: Callable[[Any], tuple[Any, ...]] | None = None
    """(frame) to the columns, if these are not the arrays"""
    more: Callable[[Any], FloatArray] | None = None
    """(frame) to the numbers that follow those of the arrays"""

    @cached_property
    def owner(self) -> str:
        """Name of the field that holds each primitive's object"""
        return f"{self.name}_object"

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Names of the arrays that may differ from frame to frame: all but indices"""
        return tuple(array.name for array in self.arrays if array.check is not Check.INDEX)

    @cached_property
    def parts(self) -> Mapping[str, tuple[slice, Row]]:
        """Places of the values of `fields` in a primitive's numbers, and the shape of their rows"""
        found, end = {}, 0
        for array in self.arrays:
            if array.check is not Check.INDEX:
                found[array.name] = slice(end, end + math.prod(array.row)), array.row
                end += math.prod(array.row)
        return found

    def numbers(self, objects: Any) -> FloatArray:
        """Return the numbers (k, 20) of each primitive of a frame."""
        further = () if self.more is None else (self.more(objects),)
        return rows(*(getattr(objects, name) for name in self.fields), *further, width=NUMBERS)

    def read(self, objects: Any) -> tuple[Any, ...]:
        """Return the columns of a frame."""
        return self.derive(objects) if self.derive else tuple([getattr(objects, name) for name in self.fields])


def by_kind(functions: Sequence[Callable[..., Any]], first: int = 0) -> Any:
    """Return a function (kind, arguments) that calls the function of this kind; other numbers call the last one."""
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
