"""Rows of a scene table from the numbers of its primitives, in one pass over all kinds."""

from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, compiled, input_indices, output_array
from robot_side.surroundings.bounds import write_around
from robot_side.surroundings.kinds.kind import by_kind
from robot_side.surroundings.kinds.layout import SHAPE_NUMBERS
from robot_side.surroundings.perceived import KINDS, PerceivedObjects

_place_any: Final = by_kind([kind.place for kind in KINDS])


@building_block
def place_one(kind: int, numbers: FloatArray, k: int, bounds: FloatArray, row: int) -> float:
    """Call `Kind.place` of this kind."""
    volume: float = _place_any(kind, numbers, k, bounds, row)
    return volume


@compiled(
    *(output_array(2), input_indices(), input_indices()),
    *(output_array(2), output_array(1), output_array(2), output_array(1)),
)
def _place(
    numbers: FloatArray,
    kinds: IntArray,
    first_rows: IntArray,
    bounds: FloatArray,
    volumes: FloatArray,
    object_bounds: FloatArray,
    object_volumes: FloatArray,
) -> None:
    for row in range(kinds.size):
        volumes[row] = place_one(kinds[row], numbers, row, bounds, row)
    for thing in range(first_rows.size - 1):
        first, end, volume = first_rows[thing], first_rows[thing + 1], 0.0
        for row in range(first, end):
            volume += volumes[row]
        object_volumes[thing] = volume
        write_around(bounds, first, end, object_bounds[thing])


class Rows(NamedTuple):
    """Result of `placed_rows`; the fields are as in SceneTable."""

    shapes: FloatArray
    bounds: FloatArray
    volumes: FloatArray
    """(n,) volume of each primitive, in m³"""
    object_bounds: FloatArray
    object_volumes: FloatArray


def placed_rows(numbers: FloatArray, kinds: IntArray, first_rows: IntArray) -> Rows:
    """Return the rows of a scene table, for primitives with these numbers (n, 20) and kinds (n,).

    The primitives of object k are from first_rows[k] up to first_rows[k + 1].
    """
    rows, objects, numbers = len(kinds), len(first_rows) - 1, numbers.copy()
    bounds, volumes = np.empty((rows, 4)), np.empty(rows)
    object_bounds, object_volumes = np.empty((objects, 4)), np.empty(objects)
    _place(numbers, kinds, first_rows, bounds, volumes, object_bounds, object_volumes)
    shapes = np.ascontiguousarray(numbers[:, :SHAPE_NUMBERS])
    return Rows(shapes, bounds, volumes, object_bounds, object_volumes)


class Primitives(NamedTuple):
    """All primitives of a frame (n), grouped by kind; fields as `primitives_of` returns them."""

    owners: IntArray
    kinds: IntArray
    rows_of_kind: IntArray


def primitives_of(objects: PerceivedObjects) -> Primitives:
    """Return the index of each primitive's object, its kind, and its row in the kind's arrays of the frame."""
    owners = [getattr(objects, kind.owner) for kind in KINDS]
    counts = [len(owner) for owner in owners]
    kinds = np.repeat(np.arange(len(KINDS)), counts)
    return Primitives(np.concatenate(owners), kinds, np.concatenate([np.arange(count) for count in counts]))


def numbers_of(objects: PerceivedObjects) -> FloatArray:
    """Return the numbers (n, 20) of all primitives of a frame, grouped by kind."""
    return np.concatenate([kind.numbers(objects) for kind in KINDS])
