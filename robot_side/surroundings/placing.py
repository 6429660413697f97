"""Rows of a scene table from the numbers of its primitives."""

from typing import NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.surroundings.bounds import around
from robot_side.surroundings.kinds.kind import Kind, Placed
from robot_side.surroundings.kinds.layout import SHAPE_NUMBERS
from robot_side.surroundings.perceived import KINDS, PerceivedObjects

Grouped = tuple[tuple[Kind, IntArray], ...]
"""Kinds of some primitives, each with the indices of its primitives"""


def grouped(kinds: IntArray) -> Grouped:
    """Return the kinds of primitives with these numbers of kinds (n,)."""
    found = [(kind, np.flatnonzero(kinds == number)) for number, kind in enumerate(KINDS)]
    return tuple(entry for entry in found if len(entry[1]))


def placed_rows(numbers: FloatArray, groups: Grouped) -> Placed:
    """Return shapes, bounds and volumes of primitives with these numbers (n, 20)."""
    count = len(numbers)
    rows = Placed(np.empty((count, SHAPE_NUMBERS)), np.empty((count, 4)), np.empty(count))
    for kind, mine in groups:
        rows.shapes[mine], rows.bounds[mine], rows.volumes_m3[mine] = kind.place(numbers[mine])
    return rows


def of_objects(rows: Placed, first_rows: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return bounds (k, 4) and volumes (k,) of objects; object k has the rows from first_rows[k] to first_rows[k + 1].

    first_rows (k + 1,) ends with the number of rows.
    """
    owners = np.repeat(np.arange(len(first_rows) - 1), np.diff(first_rows))
    volumes: FloatArray = np.bincount(owners, rows.volumes_m3, len(first_rows) - 1).astype(np.float64)
    return around(rows.bounds, first_rows), volumes


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
