"""Boxes stay as they are until their surface differs by more than a tolerance."""

import math
from typing import Final

import numpy as np

from common.arrays import IntArray
from robot_side.compiled.kernel import building_block
from robot_side.compiled.vectors import Vector, add, dot, load, scale, subtract
from robot_side.depth.octree.coplanar import axis_of
from robot_side.depth.octree.patch_columns import BoxColumns, BoxCount, PatchColumns

_SIDEWAYS: Final = 0.4
"""Cells by which an edge may differ"""
_AHEAD_M: Final = 0.0003
_AHEAD: Final = 0.5
"""Distance by which a corner of the front may differ: in m, and in standard deviations of a pixel"""
_NEARER: Final = 0.8
"""Share of a box's error below which it is written anew"""
_THICK: Final = 1.0
"""Cells of which a box is thick, unless it is narrower; thicker ones stand out behind a thin wall seen from inside"""
_LEAST_M: Final = 0.0005
"""Least half size of a box"""


@building_block
def keep_or_write(
    patches: PatchColumns, patch: int, boxes: BoxColumns, box_of: np.ndarray, node: int, edge: float, counts: IntArray
) -> int:
    """Let the node's box stay, or make it that of the patch; return its row, -1 without room."""
    row: int = box_of[node]
    a = max(0.5 * (patches.highs_m[patch, 0] - patches.lows_m[patch, 0]), _LEAST_M)
    b = max(0.5 * (patches.highs_m[patch, 1] - patches.lows_m[patch, 1]), _LEAST_M)
    half = 0.5 * min(_THICK * edge, max(2.0 * min(a, b), 0.5 * edge))
    u, v, normal = axis_of(patches, patch, 0), axis_of(patches, patch, 1), axis_of(patches, patch, 2)
    middle = add(
        scale(0.5 * (patches.highs_m[patch, 0] + patches.lows_m[patch, 0]), u),
        scale(0.5 * (patches.highs_m[patch, 1] + patches.lows_m[patch, 1]), v),
    )
    front = add(add(load(patches.means_m, patch), middle), scale(patches.rises_m[patch], normal))
    if row >= 0 and _is_near(patches, patch, boxes, row, front, (a, b), edge):
        return row
    if row < 0:
        if counts[BoxCount.FREE] > 0:
            counts[BoxCount.FREE] -= 1
            row = boxes.free[counts[BoxCount.FREE]]
        elif counts[BoxCount.TOP] < boxes.nodes.size:
            row = counts[BoxCount.TOP]
            counts[BoxCount.TOP] += 1
        else:
            return -1
        box_of[node] = row
        boxes.nodes[row] = node
    counts[BoxCount.CHANGED] += 1
    center = subtract(front, scale(half, normal))
    boxes.halves_m[row, 0], boxes.halves_m[row, 1], boxes.halves_m[row, 2] = a, b, half
    for k in range(3):
        boxes.centers_m[row, k] = center[k]
        boxes.axes[row, k], boxes.axes[row, 3 + k], boxes.axes[row, 6 + k] = u[k], v[k], normal[k]
    boxes.sds_m[row], boxes.roles[row] = patches.sds_m[patch], patches.roles[patch]
    return row


@building_block
def _is_near(
    patches: PatchColumns,
    patch: int,
    boxes: BoxColumns,
    row: int,
    front: Vector,
    halves: tuple[float, float],
    edge: float,
) -> bool:
    """Return whether the front of a patch is where that of the box is, with the same role."""
    if boxes.roles[row] != patches.roles[patch] or patches.sds_m[patch] < _NEARER * boxes.sds_m[row]:
        return False
    axes = boxes.axes
    u = axes[row, 0], axes[row, 1], axes[row, 2]
    v = axes[row, 3], axes[row, 4], axes[row, 5]
    w = axes[row, 6], axes[row, 7], axes[row, 8]
    far_u = far_v = -math.inf
    low_u = low_v = math.inf
    off = 0.0
    for corner in range(4):
        a = halves[0] if corner % 2 else -halves[0]
        b = halves[1] if corner // 2 else -halves[1]
        place = add(front, add(scale(a, axis_of(patches, patch, 0)), scale(b, axis_of(patches, patch, 1))))
        away = subtract(place, load(boxes.centers_m, row))
        far_u, low_u = max(far_u, dot(away, u)), min(low_u, dot(away, u))
        far_v, low_v = max(far_v, dot(away, v)), min(low_v, dot(away, v))
        off = max(off, abs(dot(away, w) - boxes.halves_m[row, 2]))
    a, b = boxes.halves_m[row, 0], boxes.halves_m[row, 1]
    aside = max(abs(far_u - a), abs(low_u + a), abs(far_v - b), abs(low_v + b))
    # Many surfels together know their plane better.
    share = min(1.0, 2.0 / math.sqrt(patches.counts[patch]))
    near: bool = aside <= _SIDEWAYS * edge and off <= _AHEAD_M + _AHEAD * share * boxes.sds_m[row]
    return near
