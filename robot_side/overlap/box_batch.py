"""Pairs of spheres and boxes: bounds settle most pairs whose surfaces do not cut, `box_lane` computes the others."""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import (
    INT64,
    building_block,
    compiled,
    inlined,
    input_array,
    output_array,
    output_indices,
    power_of_two_below,
)
from robot_side.compiled.vectors import Vector, cross, dot, scale, subtract
from robot_side.overlap.batch import batch, found_columns
from robot_side.overlap.checks.arguments import LARGEST, ORTHONORMALITY
from robot_side.overlap.lanes import (
    LANES,
    NOTHING,
    PARTIAL,
    WHOLE_SOLID,
    WHOLE_SPHERE,
    WIDTH,
    column,
    doubt,
    load_rows,
    reach,
    store_result,
    vector_column,
    weight,
)
from robot_side.overlap.solids.box_lane import Columns, box_lane

# Columns of a block: the pair, then the bounds' verdict, then the result.
_CENTER, _RADIUS, _BOX_CENTER, _ROTATION, _HALF_SIZES, _INPUTS = 0, 3, 4, 7, 16, 19
_BOUNDS, _SOLID_VOLUME, _RESULT = found_columns(_INPUTS)

_SLACK = 1e-5
"""Margin of the bounds, as a share of the sum of all lengths, because rotations are orthonormal only to 1e-6"""


_SURELY_ORTHONORMAL = 0.99 * ORTHONORMALITY**2
"""ORTHONORMALITY squared, less a margin for rounding"""


@inlined
def _load(
    centers: FloatArray,
    radii: FloatArray,
    boxes: tuple[FloatArray, FloatArray, FloatArray],
    first: int,
    count: int,
    block: FloatArray,
) -> None:
    load_rows(centers.reshape(-1), first, count, 3, block, _CENTER)
    load_rows(radii, first, count, 1, block, _RADIUS)
    load_rows(boxes[0].reshape(-1), first, count, 3, block, _BOX_CENTER)
    load_rows(boxes[1].reshape(-1), first, count, 9, block, _ROTATION)
    load_rows(boxes[2].reshape(-1), first, count, 3, block, _HALF_SIZES)


@inlined
def _columns(block: FloatArray, lane: int) -> Columns:
    first, second = vector_column(block, _ROTATION, lane), vector_column(block, _ROTATION + 3, lane)
    third = vector_column(block, _ROTATION + 6, lane)
    return (
        (first[0], second[0], third[0]),
        (first[1], second[1], third[1]),
        (first[2], second[2], third[2]),
    )


@building_block
def _bound(block: FloatArray, groups: int) -> int:
    """Fill the verdicts and the boxes' volumes of the first groups of lanes; return the sum of weights and doubts."""
    total = 0
    for lane in range(groups * WIDTH):
        q_0, q_1, q_2 = _columns(block, lane)
        half = vector_column(block, _HALF_SIZES, lane)
        radius = column(block, _RADIUS, lane)
        center, box_center = vector_column(block, _CENTER, lane), vector_column(block, _BOX_CENTER, lane)
        middle = subtract(box_center, center)
        volume = 8.0 * abs(dot(q_0, cross(q_1, q_2))) * (half[0] * half[1] * half[2])
        x, y, z = abs(dot(middle, q_0)), abs(dot(middle, q_1)), abs(dot(middle, q_2))
        slack = _SLACK * (radius + (half[0] + half[1] + half[2]) + (x + y + z))
        beyond = (
            max(x - half[0] - slack, 0.0),
            max(y - half[1] - slack, 0.0),
            max(z - half[2] - slack, 0.0),
        )
        corner = x + half[0] + slack, y + half[1] + slack, z + half[2] + slack
        lowest = min(half[0] - x, half[1] - y, half[2] - z)
        radius_2 = radius * radius
        away = (dot(beyond, beyond) >= radius_2) | (volume == 0.0)
        within = dot(corner, corner) <= radius_2
        verdict = WHOLE_SPHERE if lowest - slack >= radius else PARTIAL
        verdict = WHOLE_SOLID if within else verdict
        verdict = NOTHING if away else verdict
        farthest = reach(center) + reach(box_center) + reach(half) + radius
        positive = min(radius, half[0], half[1], half[2]) >= 0.0
        sure = (farthest <= LARGEST) & positive & (_excess_2(q_0, q_1, q_2) < _SURELY_ORTHONORMAL)
        total += weight(verdict) + doubt(sure)
        block[np.uint64(_BOUNDS * LANES + lane)] = verdict
        block[np.uint64(_SOLID_VOLUME * LANES + lane)] = volume
    return total


@inlined
def _excess_2(q_0: Vector, q_1: Vector, q_2: Vector) -> float:
    """Return the squared Frobenius norm of QᵀQ - I for a matrix Q with these columns."""
    first, second, third = dot(q_0, q_0) - 1.0, dot(q_1, q_1) - 1.0, dot(q_2, q_2) - 1.0
    across_0, across_1, across_2 = dot(q_1, q_2), dot(q_2, q_0), dot(q_0, q_1)
    across_2 = across_0 * across_0 + across_1 * across_1 + across_2 * across_2
    return first * first + second * second + third * third + 2.0 * across_2


@building_block
def _work_out(block: FloatArray, groups: int) -> None:
    for lane in range(groups * WIDTH):
        radius = column(block, _RADIUS, lane)
        # Lengths near 1 keep products of many from overflow; division by a power of two is exact.
        size = power_of_two_below(radius)
        shrink = 1.0 / size
        overlap, unsettled = box_lane(
            scale(shrink, vector_column(block, _CENTER, lane)),
            shrink * radius,
            scale(shrink, vector_column(block, _BOX_CENTER, lane)),
            _columns(block, lane),
            scale(shrink, vector_column(block, _HALF_SIZES, lane)),
        )
        store_result(block, _RESULT, lane, overlap, size, unsettled)


_run = batch(_load, _bound, _work_out, _INPUTS)


@compiled(
    input_array(2),
    input_array(1),
    input_array(2),
    input_array(3),
    input_array(2),
    output_array(1),
    output_array(2),
    output_array(1),
    output_indices(),
    returns=INT64,
)
def overlap_boxes(
    centers: FloatArray,
    radii: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
    rows: IntArray,
) -> int:
    """Fill the overlaps of spheres with boxes; `batch` describes the results and `rows`.

    box_centers (p, 3), box_rotations (p, 3, 3) from the box's frame to the spheres', box_half_sizes (p, 3).
    """
    return _run(centers, radii, (box_centers, box_rotations, box_half_sizes), volumes, gradients, areas, rows)
