"""Columns that go to a kernel together: declared once, from which the view in kernels and the addresses follow."""

import functools
from collections.abc import Callable
from typing import Any, Generic, TypeVar, cast

from common.arrays import IntArray
from robot_side.compiled import bundle
from robot_side.compiled.bundle import addresses
from robot_side.compiled.kernel import inlined

_Columns = TypeVar("_Columns", bound=tuple[Any, ...])
View = Callable[[IntArray, int], Any]

NUMBERS: View = bundle.numbers
"""(n,) floats"""
INDICES: View = bundle.indices
"""(n,) int64"""
FLAGS: View = bundle.flags
"""(n,) bools"""
BUNDLED: View = bundle.bundled
"""(n, 2) another bundle"""


@functools.cache
def rows(width: int) -> View:
    """(n, width) floats."""

    @inlined
    def view(found: IntArray, place: int) -> Any:
        return bundle.rows(found, place, width)

    return view


@functools.cache
def matrices(height: int, width: int) -> View:
    """(n, height, width) floats."""

    @inlined
    def view(found: IntArray, place: int) -> Any:
        return bundle.matrices(found, place, height, width)

    return view


@functools.cache
def records(dtype: Any) -> View:
    """(n,) records of `dtype`."""

    @inlined
    def view(found: IntArray, place: int) -> Any:
        return bundle.records(found, place, dtype)

    return view


class Declared(Generic[_Columns]):
    """A named tuple of arrays, with how kernels view each of them."""

    def __init__(self, columns: type[_Columns], *views: View) -> None:
        """views: one for each field, in order; TypeError for another number of them."""
        self._fields: tuple[str, ...] = cast(Any, columns)._fields
        if len(views) != len(self._fields):
            raise TypeError(f"{columns.__name__} has {len(self._fields)} columns, not {len(views)}")
        self.at: Callable[[IntArray], _Columns] = _view(columns, views)
        """From a bundle to the columns; in kernels only"""

    def bundle(self, owner: object) -> IntArray:
        """Bundle the addresses of the owner's attributes of these names; the owner must keep the arrays."""
        return addresses(*(getattr(owner, name) for name in self._fields))


def _view(columns: Any, views: tuple[View, ...]) -> Any:
    # Numba takes no loop over views of several types. Written out as source, they are one call. Joined one at a time,
    # they would be a tuple of each length: a kernel of 30 columns took half as long again to compile.
    scope = {"__name__": __name__, "columns": columns} | {f"view_{place}": view for place, view in enumerate(views)}
    given = ", ".join(f"view_{place}(found, {place})" for place in range(len(views)))
    exec(compile(f"def at(found):\n    return columns({given})\n", __file__, "exec"), scope)  # noqa: S102
    return inlined(cast(Any, scope["at"]))
