"""The rows of a scene table where the same objects are now: in one pass a kind, for every new frame of a camera."""

from typing import Any, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import TRUTH, compiled, inlined, input_array, input_indices, output_array, together
from robot_side.surroundings.bounds import write_around
from robot_side.surroundings.kinds.layout import SHAPE_NUMBERS
from robot_side.surroundings.perceived import KINDS, PerceivedObjects


def _each_kind(number: int) -> Any:
    """Make the function that places the rows of all kinds from `number` on, a kind at a time.

    One row at a time would count references to all columns again and again, which takes four times as long.
    """
    place = KINDS[number].place
    others: Any = _each_kind(number + 1) if number + 1 < len(KINDS) else None

    @inlined
    def this(columns: Any, kinds: IntArray, rows_of_kind: IntArray, *written: FloatArray) -> None:
        mine, (bounds, shapes, volumes) = columns[number], written
        for row in range(kinds.size):
            if kinds[row] == number:
                volumes[row] = place(mine, rows_of_kind[row], shapes[row], bounds[row])

    @inlined
    def this_and_others(*arguments: Any) -> None:
        this(*arguments)
        others(*arguments)

    return this if others is None else this_and_others


_place_each = _each_kind(0)


@compiled(
    together(*(together(*(input_array(1 + len(row)) for row in kind.column_rows)) for kind in KINDS)),
    *(input_indices(), input_indices(), input_indices()),
    *(output_array(2), output_array(2), output_array(1), output_array(2), output_array(1)),
    returns=TRUTH,
)
def _place(
    columns: Any,
    kinds: IntArray,
    rows_of_kind: IntArray,
    first_rows: IntArray,
    bounds: FloatArray,
    shapes: FloatArray,
    volumes: FloatArray,
    object_bounds: FloatArray,
    object_volumes: FloatArray,
) -> bool:
    shapes[:], solid = 0.0, True
    _place_each(columns, kinds, rows_of_kind, bounds, shapes, volumes)
    for thing in range(first_rows.size - 1):
        first, end, volume = first_rows[thing], first_rows[thing + 1], 0.0
        for row in range(first, end):
            solid = solid and volumes[row] > 0.0
            volume += volumes[row]
        object_volumes[thing] = volume
        write_around(bounds, first, end, object_bounds[thing])
    return solid


class Rows(NamedTuple):
    """What `place` fills, as SceneTable has it."""

    bounds: FloatArray
    shapes: FloatArray
    volumes: FloatArray
    """(n,) of the primitives, in m³"""
    object_bounds: FloatArray
    object_volumes: FloatArray


def empty_rows(rows: int, objects: int) -> Rows:
    """Make rows for these numbers of primitives and objects."""
    return Rows(
        np.empty((rows, 4)), np.empty((rows, SHAPE_NUMBERS)), np.empty(rows), np.empty((objects, 4)), np.empty(objects)
    )


def place(
    objects: PerceivedObjects, kinds: IntArray, rows_of_kind: IntArray, first_rows: IntArray, filled: Rows
) -> bool:
    """Fill the rows (n,) of these kinds, object k's from first_rows[k] on; False if one has no volume."""
    columns = tuple([kind.read(objects) for kind in KINDS])
    return bool(_place(columns, kinds, rows_of_kind, first_rows, *filled))
