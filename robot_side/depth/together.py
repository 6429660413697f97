"""Boxes that belong together: pieces of one plane, which the law takes for one object, and what is in one piece."""

from typing import Final

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.roles import ROLES
from robot_side.compiled.kernel import BOOL, compiled, inlined, input_array, input_indices, output_indices
from robot_side.compiled.vectors import dot, load, norm, subtract
from robot_side.depth.boxes import Boxes

_ALIKE: Final = 0.985
"""Least cosine of the angle between the fronts of neighbours: 10°"""
_STEP_M: Final = 0.004
"""Distance of one front's middle from the other's plane, at most"""
_GAP_M: Final = 0.012
_LARGEST_M: Final = 0.2
"""Largest distance of the middles of neighbours"""


def planes_of(boxes: Boxes) -> IntArray:
    """Return the number of each box's plane (n,), from 0; neighbours of one role with fronts in one plane share it."""
    normals, halves_m = np.ascontiguousarray(boxes.rotations[:, :, 2]), boxes.half_sizes_m
    fronts_m: FloatArray = boxes.centers_m + halves_m[:, 2:] * normals
    planes = _pieces(fronts_m, np.linalg.norm(halves_m[:, :2], axis=1), normals, in_planes=True)
    of_roles: IntArray = np.unique(planes * (len(ROLES) + 1) + boxes.roles, return_inverse=True)[1].astype(np.int64)
    return of_roles


def largest_piece(boxes: Boxes, rows: IntArray) -> BoolArray:
    """Return which of some boxes (n,) are in one piece with the largest area; the rest only looks like a part of it.

    At an object's edge a camera may see what is behind it, with the object's label.
    """
    if len(rows) == 0:
        return np.empty(0, dtype=np.bool_)
    centers_m, halves_m = boxes.centers_m[rows], boxes.half_sizes_m[rows]
    pieces = _pieces(centers_m, np.linalg.norm(halves_m, axis=1), np.zeros_like(centers_m), in_planes=False)
    areas_m2 = np.bincount(pieces, halves_m[:, :2].prod(axis=1))
    mine: BoolArray = pieces == areas_m2.argmax()
    return mine


def _pieces(points_m: FloatArray, reach_m: FloatArray, normals: FloatArray, *, in_planes: bool) -> IntArray:
    """Return for each point (n,) the number of the piece that it and its neighbours make up, from 0 by first points."""
    roots: IntArray = np.arange(len(points_m))
    _join(np.argsort(points_m[:, 0], kind="stable"), points_m, reach_m, normals, in_planes, roots)
    numbers: IntArray = np.unique(roots, return_inverse=True)[1].astype(np.int64)
    return numbers


@inlined
def _root(roots: IntArray, which: int) -> int:
    while roots[which] != which:
        # Halves the way for the next time.
        roots[which] = roots[roots[which]]
        which = roots[which]
    return which


@compiled(input_indices(), input_array(2), input_array(1), input_array(2), BOOL, output_indices())
def _join(
    order: IntArray, points: FloatArray, reach: FloatArray, normals: FloatArray, in_planes: bool, roots: IntArray
) -> None:
    """Fill `roots` (n,), 0 to n - 1 at first, with the least number among the neighbours' neighbours of each point.

    order (n,): the points along the first axis. in_planes: whether neighbours must lie in one plane.
    """
    widest = 0.0
    for i in range(reach.size):
        widest = max(widest, reach[i])
    for first in range(order.size):
        i = order[first]
        point, normal, far = load(points, i), load(normals, i), min(reach[i] + widest + _GAP_M, _LARGEST_M)
        for second in range(first + 1, order.size):
            j = order[second]
            offset = subtract(load(points, j), point)
            if offset[0] > far:
                break
            if abs(offset[1]) > far or norm(offset) > min(reach[i] + reach[j] + _GAP_M, _LARGEST_M):
                continue
            other = load(normals, j)
            if in_planes and (
                dot(normal, other) < _ALIKE or abs(dot(offset, normal)) > _STEP_M or abs(dot(offset, other)) > _STEP_M
            ):
                continue
            one, another = _root(roots, i), _root(roots, j)
            roots[max(one, another)] = min(one, another)
    for i in range(roots.size):
        roots[i] = _root(roots, i)
