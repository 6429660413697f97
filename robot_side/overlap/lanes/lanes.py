"""Columns of numbers, one lane a pair: the working memory of the vectorised loops.

A block's columns lie one after another in a single array at distances that are known when compiling, so that LLVM
can tell them apart and turn a loop over lanes into vector instructions.
"""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.transpose import transpose_four, transpose_three
from robot_side.compiled.vectors import Vector
from robot_side.overlap.closed_forms.solid import Overlap

LANES = 64
"""Pairs in a block: small enough for the columns to stay in the first-level cache."""

WIDTH = 8
"""Lanes come in groups of as many as the widest vectors hold, which spares the loops a scalar remainder."""

RESULT_COLUMNS = 6
"""V, the gradient, the area, and 1 where the pair is unsettled."""

NOTHING, WHOLE_SPHERE, WHOLE_SOLID, PARTIAL = 0.0, 1.0, 2.0, 3.0
"""What a pair's bounds tell: no contact, the sphere within the solid, the solid within the sphere, or neither."""

SOME_PARTIAL = 1 << 32
"""The sum of `weight` over a block is at least this if a lane is `PARTIAL`, and 0 if there is no contact in any."""

SOME_DOUBTFUL = 1 << 48
"""The sum of `doubt` over a block is at least this if a lane is doubtful, and else 0."""


@inlined
def column(lanes: FloatArray, index: int, lane: int) -> float:
    """Column `index` of `lane`."""
    value: float = lanes[np.uint64(index * LANES + lane)]
    return value


@inlined
def vector_column(lanes: FloatArray, index: int, lane: int) -> Vector:
    """Columns `index` to `index` + 2 of `lane`."""
    return (
        lanes[np.uint64(index * LANES + lane)],
        lanes[np.uint64((index + 1) * LANES + lane)],
        lanes[np.uint64((index + 2) * LANES + lane)],
    )


@inlined
def weight(verdict: float) -> int:
    """What one lane's bounds add to the block's sum: whole numbers, because LLVM adds no others in vectors."""
    return 0 if verdict == NOTHING else (SOME_PARTIAL if verdict == PARTIAL else 1)


@inlined
def doubt(sure: bool) -> int:
    """What one lane adds to its block's sum, whose numbers are `sure` to be in range or not."""
    return 0 if sure else SOME_DOUBTFUL


@inlined
def reach(vector: Vector) -> float:
    """The sum of the magnitudes, NaN if there is one: no part is larger."""
    return abs(vector[0]) + abs(vector[1]) + abs(vector[2])


@inlined
def store_result(lanes: FloatArray, index: int, lane: int, overlap: Overlap, size: float, unsettled: float) -> None:
    """Write an overlap that was worked out with lengths divided by `size` to the columns from `index`."""
    area = size * size
    lanes[np.uint64(index * LANES + lane)] = overlap[0] * (area * size)
    lanes[np.uint64((index + 1) * LANES + lane)] = overlap[1][0] * area
    lanes[np.uint64((index + 2) * LANES + lane)] = overlap[1][1] * area
    lanes[np.uint64((index + 3) * LANES + lane)] = overlap[1][2] * area
    lanes[np.uint64((index + 4) * LANES + lane)] = overlap[2] * area
    lanes[np.uint64((index + 5) * LANES + lane)] = unsettled


@inlined
def load_rows(rows: FloatArray, first: int, count: int, width: int, lanes: FloatArray, index: int) -> None:
    """Put `count` rows of `width` numbers from the row `first`, given flat, into the columns from `index`."""
    if count == LANES:
        # A number of lanes that is known when compiling, and vector instructions.
        for lane in range(0, LANES, 4):
            for part in range(width // 4):
                start, end = (first + lane) * width + 4 * part, (index + 4 * part) * LANES + lane
                second, third, fourth = start + width, start + 2 * width, start + 3 * width
                transpose_four(rows, start, second, third, fourth, lanes, end, LANES)
        for number in range(width // 4 * 4, width):
            for lane in range(LANES):
                lanes[np.uint64((index + number) * LANES + lane)] = rows[np.uint64((first + lane) * width + number)]
    else:
        for lane in range(count):
            for number in range(width):
                lanes[np.uint64((index + number) * LANES + lane)] = rows[np.uint64((first + lane) * width + number)]


@inlined
def load_vectors(rows: FloatArray, first: int, count: int, lanes: FloatArray, index: int) -> None:
    """`load_rows` for rows of three numbers."""
    if count == LANES:
        for lane in range(0, LANES, 4):
            transpose_three(rows, 3 * (first + lane), lanes, index * LANES + lane, LANES)
    else:
        load_rows(rows, first, count, 3, lanes, index)


@inlined
def copy_lane(lanes: FloatArray, lane: int, target: FloatArray, target_lane: int, columns: int) -> None:
    """Copy the first `columns` of `lane`."""
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
    """Write the results of `count` lanes, in the columns from `index`, to the rows `pairs` (LANES,) of the results.

    `rows` holds `unsettled` pairs that need precise forms; those of these lanes are added. How many there are then.
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
    """How many groups of `WIDTH` lanes hold `count` pairs."""
    return (count + (WIDTH - 1)) // WIDTH
