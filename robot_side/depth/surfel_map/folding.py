"""New surfels that are only the noise of another one, before or behind it, do not come to be."""

from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import building_block, compiled, input_array, input_indices, output_indices
from robot_side.compiled.vectors import Vector, add, dot, load, norm, scale, subtract, unit
from robot_side.depth.grid import cell_at
from robot_side.depth.surfel_map.collecting import FURTHEST, SLOTS
from robot_side.depth.surfel_map.surfel_columns import Count, SurfelColumns, surfels_at
from robot_side.depth.view import camera_position, pixels_across, sd_at, turned_to_world

_SIGMAS: Final = 3.0
_FEW: Final = 0.15
"""Share of the pixels that a cell seen from ahead has, below which noise may explain them"""
_AT_LEAST: Final = 1.5
"""Pixels below which noise may explain them, however far they are"""
_SETTLED: Final = 4.0
"""Pictures that a surfel is worth from which pixels beside it may be its noise, although it has none itself"""
_GRAZING: Final = 0.2
_SIGMAS_IF_FEW: Final = 5.0
_SHARE_IF_FEW: Final = 0.5
"""Share of the other surfel's pixels that they then have at most"""


@building_block
def mean_point(surfels: SurfelColumns, place: FloatArray, row: int) -> Vector:
    """Return the mean of the newest picture's points on a surfel."""
    by = 1.0 / surfels.sums[row, 0]
    return add(
        (place[0], place[1], place[2]), scale(by, (surfels.sums[row, 1], surfels.sums[row, 2], surfels.sums[row, 3]))
    )


@building_block
def mean_normal(surfels: SurfelColumns, view: FloatArray, row: int) -> Vector:
    """Return the mean of the newest picture's normals on a surfel, in the world frame."""
    sums, by = surfels.sums, 1.0 / surfels.sums[row, 0]
    return turned_to_world(view, (by * sums[row, 10], by * sums[row, 11], by * sums[row, 12]))


@building_block
def _is_noise(
    surfels: SurfelColumns, view: FloatArray, place: FloatArray, cells: IntArray, slot: np.ndarray, row: int
) -> bool:
    """Return whether a surfel's points are but the noise of another one's, before or behind it."""
    edge, count, depth = place[3], surfels.sums[row, 0], surfels.sums[row, 13]
    few = count < max(_FEW * pixels_across(view, edge, depth) ** 2, _AT_LEAST)
    if not few and surfels.weights[row] > 0.0:
        return False
    sigmas, most = (_SIGMAS_IF_FEW, _SHARE_IF_FEW) if few else (_SIGMAS, 1.0)
    point, near = mean_point(surfels, place, row), sigmas * sd_at(view, depth)
    ray = unit(subtract(point, camera_position(view)))
    for half in range(2, 2 * min(int(near / edge + 0.5), FURTHEST) + 4):
        step = (0.25 if half % 2 else -0.25) * (half // 2 * 2)
        cell = cell_at(place, cells, add(point, scale(step * edge, ray)))
        other = slot[cell] if cell >= 0 else -1
        if other < 0 or other == row:
            continue
        there, normal = load(surfels.points_m, other), load(surfels.normals, other)
        if surfels.sums[other, 14] == surfels.sums[row, 14]:
            there, normal = mean_point(surfels, place, other), mean_normal(surfels, view, other)
            dominant = count <= most * surfels.sums[other, 0] and count < surfels.sums[other, 0]
        else:
            dominant = few and surfels.weights[other] >= _SETTLED
        away, facing = subtract(point, there), unit(normal)
        slant = max(abs(dot(ray, facing)), _GRAZING)
        if dominant and abs(dot(away, facing)) <= near * slant and norm(away) <= edge + near:
            return True
    return False


@compiled(input_array(1), input_array(1), input_indices(), SLOTS, BUNDLE, output_indices())
def fold_layers(
    view: FloatArray, place: FloatArray, cells: IntArray, slot: np.ndarray, bundle: IntArray, counts: IntArray
) -> None:
    """Leave out each surfel beside one with more pixels, along the ray, whose plane it is in but for its errors.

    That is for new surfels, which do not come to be, and for those with few pixels, as if they had none.
    """
    surfels, kept = surfels_at(bundle), 0
    for t in range(counts[Count.TOUCHED]):
        row = surfels.touched[t]
        if not _is_noise(surfels, view, place, cells, slot, row):
            surfels.touched[kept] = row
            kept += 1
            continue
        surfels.seen[row] = 0
        if surfels.weights[row] == 0.0:
            slot[surfels.cells[row]] = -1
            surfels.cells[row] = -1
            surfels.free[counts[Count.FREE]] = row
            counts[Count.FREE] += 1
            counts[Count.MADE] -= 1
    counts[Count.TOUCHED] = kept
