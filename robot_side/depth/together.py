"""Boxes that belong together: pieces of one plane, which the law takes for one object, and what is in one piece."""

from typing import Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.depth.boxes import Boxes

_ALIKE: Final = 0.985
"""Least cosine of the angle between the fronts of neighbours: 10°"""
_STEP_M: Final = 0.004
"""Distance of one front's middle from the other's plane, at most"""
_GAP_M: Final = 0.012
_LARGEST_M: Final = 0.2
"""Largest distance of the middles of neighbours"""


def planes_of(boxes: Boxes) -> IntArray:
    """Return the number of each box's plane (n,), from 0; neighbours with fronts in one plane share it."""
    count = len(boxes.ids)
    if count == 0:
        return np.empty(0, dtype=np.int64)
    normals, halves_m = boxes.rotations[:, :, 2], boxes.half_sizes_m
    fronts_m: FloatArray = boxes.centers_m + halves_m[:, 2:] * normals
    reach_m = np.linalg.norm(halves_m[:, :2], axis=1)
    one, other = cKDTree(fronts_m).query_pairs(_LARGEST_M, output_type="ndarray").T
    offsets_m = fronts_m[other] - fronts_m[one]
    near = np.linalg.norm(offsets_m, axis=1) <= reach_m[one] + reach_m[other] + _GAP_M
    near &= np.einsum("ni,ni->n", normals[one], normals[other]) >= _ALIKE
    near &= np.abs(np.einsum("ni,ni->n", offsets_m, normals[one])) <= _STEP_M
    near &= np.abs(np.einsum("ni,ni->n", offsets_m, normals[other])) <= _STEP_M
    graph = coo_array((np.ones(near.sum()), (one[near], other[near])), shape=(count, count))
    numbers: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return numbers


def largest_piece(boxes: Boxes, rows: IntArray) -> BoolArray:
    """Return which of some boxes (n,) are in one piece with the largest area; the rest only looks like a part of it.

    At an object's edge a camera may see what is behind it, with the object's label.
    """
    count = len(rows)
    if count == 0:
        return np.empty(0, dtype=np.bool_)
    centers_m, halves_m = boxes.centers_m[rows], boxes.half_sizes_m[rows]
    reach_m = np.linalg.norm(halves_m, axis=1)
    one, other = cKDTree(centers_m).query_pairs(_LARGEST_M, output_type="ndarray").T
    near = np.linalg.norm(centers_m[other] - centers_m[one], axis=1) <= reach_m[one] + reach_m[other] + _GAP_M
    graph = coo_array((np.ones(near.sum()), (one[near], other[near])), shape=(count, count))
    pieces = connected_components(graph, directed=False)[1]
    areas_m2 = np.bincount(pieces, halves_m[:, :2].prod(axis=1))
    mine: BoolArray = pieces == areas_m2.argmax()
    return mine
