"""Points of a picture, summed by cell. A point beside a known surface belongs to it, so that noise makes no layers."""

from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import array_of, building_block, compiled, input_array, input_indices, output_indices
from robot_side.compiled.vectors import Vector, add, dot, load, norm, scale, subtract
from robot_side.depth.grid import cell_at
from robot_side.depth.picture import DepthArray, LabelArray
from robot_side.depth.surfel_map.surfel_columns import Count, SurfelColumns, surfels_at
from robot_side.depth.view import DIRECTIONS, MASK, PICTURE, ray_at, sd_at, to_world, turned_to_world

_SIGMAS: Final = 3.0
_WITHOUT_NORMAL: Final = 0.1
"""Weight of the direction to the camera where a pixel has no normal"""
FURTHEST: Final = 3
"""Cells along a ray that are searched at most"""
_NO_ROLE: Final = -1
SLOTS: Final = array_of(np.int32, 1)
"""Numba type of the surfels' rows by cell (c,); -1: no surfel"""


@building_block
def _beside(
    surfels: SurfelColumns,
    place: FloatArray,
    cells: IntArray,
    slot: np.ndarray,
    point: Vector,
    ray: Vector,
    near: float,
) -> int:
    """Return the surfel along a ray, before or behind a point, to which the point belongs; -1 if none."""
    edge = place[3]
    for half in range(2, 2 * min(int(near / edge + 0.5), FURTHEST) + 4):
        step = (0.25 if half % 2 else -0.25) * (half // 2 * 2)
        cell = cell_at(place, cells, add(point, scale(step * edge, ray)))
        row: int = slot[cell] if cell >= 0 else -1
        if row >= 0 and surfels.weights[row] > 0.0:
            normal, away = load(surfels.normals, row), subtract(point, load(surfels.points_m, row))
            # The error is along the ray, so that a grazed surface shows less of it.
            off = near * min(abs(dot(ray, normal)) + 0.2, norm(normal))
            if abs(dot(away, normal)) <= off and norm(away) <= near + 1.2 * edge:
                return row
    return -1


@building_block
def _new_surfel(surfels: SurfelColumns, slot: np.ndarray, cell: int, counts: IntArray) -> int:
    """Return the row of a new surfel in a cell; -1 without room."""
    if counts[Count.FREE] > 0:
        counts[Count.FREE] -= 1
        row: int = surfels.free[counts[Count.FREE]]
    elif counts[Count.TOP] < surfels.cells.size:
        row = counts[Count.TOP]
        counts[Count.TOP] += 1
    else:
        counts[Count.FULL] += 1
        return -1
    slot[cell] = row
    surfels.cells[row] = cell
    surfels.weights[row] = 0.0
    surfels.evidence[row] = surfels.astray[row] = surfels.shown[row] = surfels.seen[row] = 0
    surfels.roles[row], surfels.pointed[row] = _NO_ROLE, 0
    counts[Count.MADE] += 1
    return row


@building_block
def _begin(surfels: SurfelColumns, row: int, depth: float, counts: IntArray) -> None:
    """Clear a surfel's sums for its first pixel in a picture."""
    surfels.seen[row] = counts[Count.PICTURE]
    surfels.touched[counts[Count.TOUCHED]] = row
    counts[Count.TOUCHED] += 1
    for k in range(13):
        surfels.sums[row, k] = 0.0
    surfels.sums[row, 13], surfels.sums[row, 14] = depth, counts[Count.PICTURE]
    surfels.votes[row] = 0


@building_block
def _add_point(sums: FloatArray, row: int, point: Vector, normal: Vector) -> None:
    """Add a point, its products and its normal to a surfel's sums."""
    u, v, w = point
    sums[row, 0] += 1.0
    sums[row, 1] += u
    sums[row, 2] += v
    sums[row, 3] += w
    sums[row, 4] += u * u
    sums[row, 5] += v * v
    sums[row, 6] += w * w
    sums[row, 7] += u * v
    sums[row, 8] += u * w
    sums[row, 9] += v * w
    sums[row, 10] += normal[0]
    sums[row, 11] += normal[1]
    sums[row, 12] += normal[2]


@compiled(
    *(PICTURE, MASK, MASK, input_indices(), DIRECTIONS, input_array(1)),
    *(input_array(1), input_indices(), SLOTS, BUNDLE, output_indices()),
)
def collect(
    depth_m: DepthArray,
    own: LabelArray,
    labels: LabelArray,
    roles: IntArray,
    normals: DepthArray,
    view: FloatArray,
    place: FloatArray,
    cells: IntArray,
    slot: np.ndarray,
    bundle: IntArray,
    counts: IntArray,
) -> None:
    """Add the picture's points to the sums of surfels, new ones where there are none."""
    surfels = surfels_at(bundle)
    height, width = depth_m.shape
    counts[Count.TOUCHED] = 0
    counts[Count.PICTURE] += 1
    for i in range(height):
        for j in range(width):
            z = 1.0 * depth_m[i, j]
            if z <= 0.0 or own[i, j]:
                continue
            x, y = ray_at(view, i, j)
            point = to_world(view, (x * z, y * z, z))
            cell = cell_at(place, cells, point)
            if cell < 0:
                continue
            row = slot[cell]
            if row < 0:
                # Near its ray, within its errors, there may be the surface that the point belongs to.
                near, ray = _SIGMAS * sd_at(view, z), turned_to_world(view, (x, y, 1.0))
                row = _beside(surfels, place, cells, slot, point, ray, near)
            if row < 0:
                row = _new_surfel(surfels, slot, cell, counts)
            if row < 0:
                continue
            if surfels.seen[row] != counts[Count.PICTURE]:
                _begin(surfels, row, z, counts)
            normal = 1.0 * normals[i, j, 0], 1.0 * normals[i, j, 1], 1.0 * normals[i, j, 2]
            if dot(normal, normal) == 0.0:
                normal = scale(-_WITHOUT_NORMAL / norm((x, y, 1.0)), (x, y, 1.0))
            _add_point(surfels.sums, row, subtract(point, (place[0], place[1], place[2])), normal)
            surfels.sums[row, 13] = min(surfels.sums[row, 13], z)
            if labels.size > 1:
                role = roles[labels[i, j]]
                if surfels.votes[row] == 0:
                    surfels.candidates[row] = role
                surfels.votes[row] += 1 if surfels.candidates[row] == role else -1
