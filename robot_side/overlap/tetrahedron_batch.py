"""Pairs of spheres and tetrahedra: bounds settle most without a cut, `tetrahedron_lane` computes the others."""

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
from robot_side.overlap.checks.arguments import LARGEST
from robot_side.overlap.lanes import (
    LANES,
    NOTHING,
    PARTIAL,
    SOME_DOUBTFUL,
    SOME_PARTIAL,
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
from robot_side.overlap.solids.tetrahedron_lane import tetrahedron_lane

# Columns of a block: the pair, then the bounds' verdict, then the result.
_CENTER, _RADIUS, _CORNERS, _INPUTS = 0, 3, 4, 16
_BOUNDS, _SOLID_VOLUME, _RESULT = found_columns(_INPUTS)

_SURE = 1.0 + 1e-9
"""Factor on squared lengths by which the bounds allow for rounding"""

_TINY_2 = 1e-150
"""Square of the radius, divided by that of the farthest corner's distance, up to which a sphere counts as a point:
products of four such lengths would overflow"""

_ROUNDING_2 = 1e-21
"""(8 · 2⁻⁵³)² / 1e-9: allowance for the rounding error of a product of three lengths, where the factor above does not
cover it. It is relative to the sixth power of the longest length, as the product is squared."""


@inlined
def _load(
    centers: FloatArray, radii: FloatArray, tetrahedra: tuple[FloatArray], first: int, count: int, block: FloatArray
) -> None:
    load_rows(centers.reshape(-1), first, count, 3, block, _CENTER)
    load_rows(radii, first, count, 1, block, _RADIUS)
    load_rows(tetrahedra[0].reshape(-1), first, count, 12, block, _CORNERS)


@inlined
def _corners(block: FloatArray, lane: int) -> tuple[Vector, Vector, Vector, Vector]:
    return (
        vector_column(block, _CORNERS, lane),
        vector_column(block, _CORNERS + 3, lane),
        vector_column(block, _CORNERS + 6, lane),
        vector_column(block, _CORNERS + 9, lane),
    )


@inlined
def _bound(block: FloatArray, groups: int) -> int:
    """Fill the verdicts and the volumes of the first groups of lanes; return the sum of weights and doubts."""
    left = _bound_by_corners(block, groups)
    doubts = left // SOME_DOUBTFUL * SOME_DOUBTFUL
    left -= doubts
    if left % SOME_PARTIAL > 0:
        left = _measure_within(block, groups)
    if left >= SOME_PARTIAL:
        left = _bound_by_planes(block, groups)
    return doubts + left


@building_block
def _bound_by_corners(block: FloatArray, groups: int) -> int:
    """Fill verdicts that follow from the corners and their bounding box; return the sum of weights and doubts."""
    total = 0
    for lane in range(groups * WIDTH):
        first, second, third, fourth = _corners(block, lane)
        center, radius = vector_column(block, _CENTER, lane), column(block, _RADIUS, lane)
        a, b = subtract(first, center), subtract(second, center)
        c, d = subtract(third, center), subtract(fourth, center)
        radius_2 = radius * radius
        beyond_2 = (
            _beyond_2(a[0], b[0], c[0], d[0]) + _beyond_2(a[1], b[1], c[1], d[1]) + _beyond_2(a[2], b[2], c[2], d[2])
        )
        farthest_2 = max(dot(a, a), dot(b, b), dot(c, c), dot(d, d))
        away = (beyond_2 >= radius_2 * _SURE) | (radius_2 <= _TINY_2 * farthest_2)
        verdict = WHOLE_SOLID if farthest_2 * _SURE <= radius_2 else PARTIAL
        verdict = NOTHING if away else verdict
        farthest = reach(center) + reach(first) + reach(second) + reach(third) + reach(fourth) + radius
        total += weight(verdict) + doubt((farthest <= LARGEST) & (radius >= 0.0))
        block[np.uint64(_BOUNDS * LANES + lane)] = verdict
    return total


@building_block
def _measure_within(block: FloatArray, groups: int) -> int:
    """Fill the tetrahedra's volumes, which are the results of those within the sphere; return the sum of weights.

    A flat tetrahedron within the sphere becomes `PARTIAL`, because its volume would lose digits here.
    """
    total = 0
    for lane in range(groups * WIDTH):
        first, second, third, fourth = _corners(block, lane)
        ab, ac, ad = subtract(second, first), subtract(third, first), subtract(fourth, first)
        volume_6 = dot(ab, cross(ac, ad))
        longest_2 = max(dot(ab, ab), dot(ac, ac), dot(ad, ad))
        # The volume of a flatter tetrahedron would lose digits here.
        flat = volume_6 * volume_6 <= 1e-14 * (longest_2 * longest_2 * longest_2)
        verdict = column(block, _BOUNDS, lane)
        verdict = PARTIAL if (verdict == WHOLE_SOLID) & flat else verdict
        total += weight(verdict)
        block[np.uint64(_BOUNDS * LANES + lane)] = verdict
        block[np.uint64(_SOLID_VOLUME * LANES + lane)] = abs(volume_6) / 6.0
    return total


@building_block
def _bound_by_planes(block: FloatArray, groups: int) -> int:
    """Settle some of the `PARTIAL` pairs by the planes of the faces; return the sum of weights."""
    total = 0
    for lane in range(groups * WIDTH):
        first, second, third, fourth = _corners(block, lane)
        center, radius = vector_column(block, _CENTER, lane), column(block, _RADIUS, lane)
        a, b = subtract(first, center), subtract(second, center)
        ab, ac, ad = subtract(second, first), subtract(third, first), subtract(fourth, first)
        size_2 = max(dot(a, a), dot(ab, ab), dot(ac, ac), dot(ad, ad))
        enough_2, rounding = radius * radius * _SURE, _ROUNDING_2 * (size_2 * size_2 * size_2)
        across_d = cross(ac, ab)
        sense = 1.0 if dot(ad, across_d) < 0.0 else -1.0
        below_a, above_a = _side(sense, b, cross(subtract(third, second), subtract(fourth, second)), enough_2, rounding)
        below_b, above_b = _side(sense, a, cross(ad, ac), enough_2, rounding)
        below_c, above_c = _side(sense, a, cross(ab, ad), enough_2, rounding)
        below_d, above_d = _side(sense, a, across_d, enough_2, rounding)
        verdict = column(block, _BOUNDS, lane)
        partial = verdict == PARTIAL
        verdict = WHOLE_SPHERE if partial & (below_a & below_b & below_c & below_d) else verdict
        verdict = NOTHING if partial & (above_a | above_b | above_c | above_d) else verdict
        total += weight(verdict)
        block[np.uint64(_BOUNDS * LANES + lane)] = verdict
    return total


@inlined
def _beyond_2(a: float, b: float, c: float, d: float) -> float:
    """Return the squared distance (m²) of 0 from the interval that the four numbers span."""
    gap = max(min(a, b, c, d), -max(a, b, c, d), 0.0)
    return gap * gap


@inlined
def _side(sense: float, corner: Vector, across: Vector, enough_2: float, rounding: float) -> tuple[bool, bool]:
    """Return whether the centre lies below a face's plane by at least √`enough_2` (m), and whether above it by as much.

    `across` is the face's normal, twice its area long; `sense` is 1 or -1, so that below is inside. `rounding` (m⁶)
    allows for the rounding error of the product of `across` and `corner`, which is squared.
    """
    height = sense * dot(corner, across)
    far = height * height >= enough_2 * dot(across, across) + rounding
    return far & (height > 0.0), far & (height < 0.0)


@building_block
def _work_out(block: FloatArray, groups: int) -> None:
    for lane in range(groups * WIDTH):
        radius = column(block, _RADIUS, lane)
        # Lengths near 1 keep products of many from overflow; division by a power of two is exact.
        size = power_of_two_below(radius)
        shrink = 1.0 / size
        first, second, third, fourth = _corners(block, lane)
        corners = scale(shrink, first), scale(shrink, second), scale(shrink, third), scale(shrink, fourth)
        center = scale(shrink, vector_column(block, _CENTER, lane))
        overlap, unsettled = tetrahedron_lane(center, shrink * radius, corners)
        store_result(block, _RESULT, lane, overlap, size, unsettled)


_run = batch(_load, _bound, _work_out, _INPUTS)


@compiled(
    input_array(2),
    input_array(1),
    input_array(3),
    output_array(1),
    output_array(2),
    output_array(1),
    output_indices(),
    returns=INT64,
)
def overlap_tetrahedra(
    centers: FloatArray,
    radii: FloatArray,
    vertices: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
    rows: IntArray,
) -> int:
    """Fill the overlaps of spheres with the tetrahedra `vertices` (p, 4, 3); `batch` describes results and `rows`."""
    return _run(centers, radii, (vertices,), volumes, gradients, areas, rows)
