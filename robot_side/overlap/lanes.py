"""Working memory of the vectorised loops: a block has columns of numbers, with one lane for each pair.

A block's columns lie one after another in a single array, at distances known at compile time. So LLVM can see that
columns do not overlap, and compile a loop over lanes to vector instructions.
"""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector
from robot_side.overlap.solids.solid import Overlap

LANES = 64
"""Number of pairs in a block: few enough for the columns to stay in the first-level cache"""

WIDTH = 8
"""Number of lanes in a group: as many as the widest vector registers hold, so that loops have no scalar remainder"""

RESULT_COLUMNS = 6
"""Number of columns of a result: V, the gradient (3), the area, and 1 if the pair needs precise forms"""

NOTHING, WHOLE_SPHERE, WHOLE_SOLID, PARTIAL = 0.0, 1.0, 2.0, 3.0
"""Verdicts of the bounds on a pair: no contact, sphere within the solid, solid within the sphere, none of these"""

SOME_PARTIAL = 1 << 32
"""`weight` of a lane that is `PARTIAL`. A block's sum of weights is less if none is, and 0 if there is no contact."""

SOME_DOUBTFUL = 1 << 48
"""`doubt` of a lane whose numbers may be wrong. A block's sum of weights is always less."""


@inlined
def column(lanes: FloatArray, index: int, lane: int) -> float:
    """Return column `index` of `lane`."""
    value: float = lanes[np.uint64(index * LANES + lane)]
    return value


@inlined
def vector_column(lanes: FloatArray, index: int, lane: int) -> Vector:
    """Return columns `index` to `index` + 2 of `lane`."""
    return (
        lanes[np.uint64(index * LANES + lane)],
        lanes[np.uint64((index + 1) * LANES + lane)],
        lanes[np.uint64((index + 2) * LANES + lane)],
    )


@inlined
def weight(verdict: float) -> int:
    """Return the term of one lane's verdict in the block's sum: an integer, as LLVM sums only integers in vectors."""
    return 0 if verdict == NOTHING else (SOME_PARTIAL if verdict == PARTIAL else 1)


@inlined
def doubt(sure: bool) -> int:
    """Return a lane's term in the block's sum for its numbers. `sure`: whether they are certainly in range."""
    return 0 if sure else SOME_DOUBTFUL


@inlined
def reach(vector: Vector) -> float:
    """Return the sum of the components' magnitudes, an upper bound of each of them; NaN if one is NaN."""
    return abs(vector[0]) + abs(vector[1]) + abs(vector[2])


@inlined
def store_result(lanes: FloatArray, index: int, lane: int, overlap: Overlap, size: float, unsettled: float) -> None:
    """Write an overlap to the columns from `index` on. It was computed with all lengths divided by `size` (m)."""
    area = size * size
    lanes[np.uint64(index * LANES + lane)] = overlap[0] * (area * size)
    lanes[np.uint64((index + 1) * LANES + lane)] = overlap[1][0] * area
    lanes[np.uint64((index + 2) * LANES + lane)] = overlap[1][1] * area
    lanes[np.uint64((index + 3) * LANES + lane)] = overlap[1][2] * area
    lanes[np.uint64((index + 4) * LANES + lane)] = overlap[2] * area
    lanes[np.uint64((index + 5) * LANES + lane)] = unsettled


@inlined
def load_rows(rows: FloatArray, first: int, count: int, width: int, lanes: FloatArray, index: int) -> None:
    """Copy `count` rows, from row `first` on, of a flat array into lanes of the block, one number a column.

    Rows have `width` numbers, for as many columns from `index` on.
    """
    for lane in range(count):
        for number in range(width):
            lanes[np.uint64((index + number) * LANES + lane)] = rows[np.uint64((first + lane) * width + number)]


@inlined
def copy_lane(lanes: FloatArray, lane: int, target: FloatArray, target_lane: int, columns: int) -> None:
    """Copy the first `columns` numbers of `lane` to the lane `target_lane` of `target`."""
    for index in range(columns):
        target[np.uint64(index * LANES + target_lane)] = lanes[np.uint64(index * LANES + lane)]


@inlined
def scatter(
    lanes: FloatArray,
    index: int,
    pairs: IntArray,
    count: int,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
    rows: IntArray,
    unsettled: int,
) -> int:
    """Write the results of `count` lanes, in the columns from `index` on, to the rows `pairs` (LANES,) of the results.

    The first `unsettled` entries of `rows` are pairs that need precise forms. Such pairs among these lanes are added;
    return the new number.
    """
    for lane in range(count):
        pair = pairs[lane]
        volumes[pair] = column(lanes, index, lane)
        gradients[pair, 0], gradients[pair, 1], gradients[pair, 2] = vector_column(lanes, index + 1, lane)
        areas[pair] = column(lanes, index + 4, lane)
        if column(lanes, index + 5, lane) != 0.0:
            rows[unsettled] = pair
            unsettled += 1
    return unsettled


@inlined
def lane_groups(count: int) -> int:
    """Return the number of groups of `WIDTH` lanes that `count` pairs need."""
    return (count + (WIDTH - 1)) // WIDTH
