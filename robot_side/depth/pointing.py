"""Patch of surface that the operator points at, where no segmentation tells objects."""

from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.depth.boxes import Boxes
from robot_side.depth.surfel_map.surfels import SurfelMap
from robot_side.depth.together import planes_of

_REACH_M: Final = 0.1
"""Distance from the box that was pointed at, within which its patch ends"""
_LARGE_M2: Final = 0.03
"""Area from which on a plane is a support or a wall, and no part of what can be grasped"""
_NEXT_CELLS: Final = 1.8
"""Distance of neighbours, in cells"""


def patch_around(boxes: Boxes, box: int, surfels: SurfelMap, cell_m: float) -> IntArray:
    """Return the rows of the surfels (n,) that are connected with the box in row `box`, but for large planes.

    If it is itself large, these are its own surfels near its centre.
    """
    rows: IntArray = surfels.shown
    points_m = surfels.table.points_m[rows]
    near = np.linalg.norm(points_m - boxes.centers_m[box], axis=1) <= _REACH_M + float(boxes.half_sizes_m[box].max())
    rows, points_m = rows[near], points_m[near]
    seeds = _within(boxes, box, points_m, cell_m)
    planes = planes_of(boxes)
    areas_m2 = np.bincount(planes, 4.0 * boxes.half_sizes_m[:, :2].prod(axis=1))
    large = np.flatnonzero(areas_m2[planes] >= _LARGE_M2)
    for other in large[large != box].tolist():
        small = ~_within(boxes, other, points_m, cell_m)
        points_m, rows, seeds = points_m[small], rows[small], seeds[small]
    if not len(rows) or box in large:
        own: IntArray = rows[seeds]
        return own
    reached, tree = seeds, cKDTree(points_m)
    front = np.flatnonzero(seeds)
    while front.size:
        beside = np.unique(
            np.concatenate(tree.query_ball_point(points_m[front], _NEXT_CELLS * cell_m)).astype(np.int64)
        )
        front = beside[~reached[beside]]
        reached[front] = True
    found: IntArray = rows[reached]
    return found


def _within(boxes: Boxes, box: int, points_m: FloatArray, cell_m: float) -> BoolArray:
    """Return whether points (n, 3) are on the front of a box, or beside it by at most a cell."""
    local = (points_m - boxes.centers_m[box]) @ boxes.rotations[box]
    away: BoolArray = (np.abs(local) <= boxes.half_sizes_m[box] + cell_m).all(axis=1)
    return away
