"""Patches of one plane that lie side by side become one."""

import math
from typing import Final

import numpy as np

from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, dot, load, scale, subtract
from robot_side.depth.octree.partition import LENIENCE
from robot_side.depth.octree.patch_columns import PatchColumns
from robot_side.depth.octree.plane_fit import along, choose_normal, measure_rise, normal_of

_ALIKE: Final = 0.9
"""Least product of the normals of two patches that may be one"""
_IN_LINE: Final = 0.998
_BESIDE: Final = 0.5
"""Cells by which the edges of two rectangles side by side may differ, and the gap between them may measure"""
_FLAT_M: Final = 0.001
_FEWER: Final = 0.5
"""Share of a patch's surfels that another one has at most that may be its noise"""


@inlined
def axis_of(patches: PatchColumns, patch: int, k: int) -> Vector:
    """Return an axis of a patch's rectangle: 0 or 1 along an edge, 2 the normal."""
    return patches.axes[patch, 3 * k], patches.axes[patch, 3 * k + 1], patches.axes[patch, 3 * k + 2]


@building_block
def merge_coplanar(patches: PatchColumns, count: int, edge: float, into: np.ndarray, nodes: int) -> None:
    """Merge patches (of the first `count`) as long as two together are a rectangle in a plane; mark those that went.

    into: node with which each was together before; the block's begin at `nodes`.
    """
    # Rows from `count` on are free: the next one holds what two patches would be together.
    for first in range(count):
        second = 0
        while second < count:
            apart = first == second or patches.nodes[first] < 0 or patches.nodes[second] < 0
            if not apart and _try(patches, first, second, count, edge, _lenience(patches, first, second, into, nodes)):
                into[nodes + patches.nodes[second]] = patches.nodes[first]
                into[nodes + patches.nodes[first]] = patches.nodes[second]
                patches.nodes[first] = min(patches.nodes[first], patches.nodes[second])
                patches.nodes[second] = -1
                second = -1
            second += 1


@building_block
def absorb(patches: PatchColumns, count: int, edge: float, into: np.ndarray, nodes: int) -> None:
    """Mark patches (of the first `count`) that lie in a larger one's box, or before it by no more than noise."""
    for small in range(count):
        for large in range(count):
            if small == large or patches.nodes[small] < 0 or patches.nodes[large] < 0:
                continue
            lenience = _lenience(patches, small, large, into, nodes)
            few = patches.counts[small] <= lenience * _FEWER * patches.counts[large]
            if few and _lies_in(patches, small, large, edge, lenience):
                into[nodes + patches.nodes[small]] = patches.nodes[large]
                patches.nodes[small] = -1


@inlined
def _lenience(patches: PatchColumns, first: int, second: int, into: np.ndarray, nodes: int) -> float:
    """Return the factor on tolerances: larger for patches that were together before."""
    a, b = patches.nodes[first], patches.nodes[second]
    return LENIENCE if into[nodes + a] == b or into[nodes + b] == a else 1.0


@building_block
def _lies_in(patches: PatchColumns, small: int, large: int, edge: float, lenience: float) -> bool:
    if patches.roles[small] != patches.roles[large]:
        return False
    between = subtract(load(patches.means_m, small), load(patches.means_m, large))
    between = add(between, scale(patches.rises_m[small], normal_of(patches, small)))
    u, v, normal = axis_of(patches, large, 0), axis_of(patches, large, 1), normal_of(patches, large)
    aside = 0.25 * lenience * edge
    for corner in range(4):
        away = add(between, _corner(patches, small, corner))
        a, b, c = dot(away, u), dot(away, v), dot(away, normal)
        if a < patches.lows_m[large, 0] - aside or a > patches.highs_m[large, 0] + aside:
            return False
        if b < patches.lows_m[large, 1] - aside or b > patches.highs_m[large, 1] + aside:
            return False
        if c < -2.0 * edge or c > patches.rises_m[large] + lenience * (_FLAT_M + patches.sds_m[large]):
            return False
    return True


@building_block
def _try(patches: PatchColumns, first: int, second: int, free: int, edge: float, lenience: float) -> bool:
    """Return whether the second patch could be merged into the first, which is then the whole."""
    if patches.roles[first] != patches.roles[second]:
        return False
    normal = normal_of(patches, first)
    if dot(normal, normal_of(patches, second)) < _ALIKE:
        return False
    tolerance = lenience * (_FLAT_M + max(patches.sds_m[first], patches.sds_m[second]))
    between = subtract(load(patches.means_m, second), load(patches.means_m, first))
    reach = math.hypot(*_size(patches, first)) + math.hypot(*_size(patches, second))
    if dot(between, between) > reach * reach or abs(dot(between, normal)) > 2.0 * tolerance + 0.1 * edge:
        return False
    # The first one's edges, as the second one's corners see them.
    u, v = axis_of(patches, first, 0), axis_of(patches, first, 1)
    turned = abs(dot(u, axis_of(patches, second, 0))) < _IN_LINE
    if turned and abs(dot(u, axis_of(patches, second, 1))) < _IN_LINE:
        return False
    low_u = low_v = math.inf
    high_u = high_v = -math.inf
    for corner in range(4):
        away = add(between, _corner(patches, second, corner))
        low_u, high_u = min(low_u, dot(away, u)), max(high_u, dot(away, u))
        low_v, high_v = min(low_v, dot(away, v)), max(high_v, dot(away, v))
    gap = lenience * _BESIDE * edge
    left, right = patches.lows_m[first, 0], patches.highs_m[first, 0]
    low, high = patches.lows_m[first, 1], patches.highs_m[first, 1]
    row = abs(low_v - low) <= gap and abs(high_v - high) <= gap and max(left, low_u) - min(right, high_u) <= gap
    column = abs(low_u - left) <= gap and abs(high_u - right) <= gap and max(low, low_v) - min(high, high_v) <= gap
    if not (row or column):
        return False
    _together(patches, first, second, free, edge)
    if not _fits(patches, first, free, tolerance, edge) or not _fits(patches, second, free, tolerance, edge):
        return False
    if along(patches.moments_m2, free, normal_of(patches, free)) > (0.5 * tolerance) ** 2:
        return False
    ends = min(left, low_u), max(right, high_u), min(low, low_v), max(high, high_v)
    shift = subtract(load(patches.means_m, first), load(patches.means_m, free))
    _take(patches, first, free, ends, (dot(shift, u), dot(shift, v)))
    measure_rise(patches, first, edge)
    return True


@inlined
def _size(patches: PatchColumns, patch: int) -> tuple[float, float]:
    return (
        max(patches.highs_m[patch, 0], -patches.lows_m[patch, 0]),
        max(patches.highs_m[patch, 1], -patches.lows_m[patch, 1]),
    )


@inlined
def _corner(patches: PatchColumns, patch: int, corner: int) -> Vector:
    """Return a corner of a patch's rectangle, from its mean."""
    a = patches.highs_m[patch, 0] if corner % 2 else patches.lows_m[patch, 0]
    b = patches.highs_m[patch, 1] if corner // 2 else patches.lows_m[patch, 1]
    return add(scale(a, axis_of(patches, patch, 0)), scale(b, axis_of(patches, patch, 1)))


@building_block
def _together(patches: PatchColumns, first: int, second: int, free: int, edge: float) -> None:
    """Write the moments and the normal of two patches together into a free row."""
    a, b = patches.counts[first], patches.counts[second]
    share = b / (a + b)
    between = subtract(load(patches.means_m, second), load(patches.means_m, first))
    x, y, z = between
    products = x * x, y * y, z * z, x * y, x * z, y * z
    for k in range(3):
        patches.means_m[free, k] = patches.means_m[first, k] + share * between[k]
        patches.normals[free, k] = patches.normals[first, k] + patches.normals[second, k]
    for k in range(6):
        mean = patches.moments_m2[first, k] + share * (patches.moments_m2[second, k] - patches.moments_m2[first, k])
        patches.moments_m2[free, k] = mean + share * (1.0 - share) * products[k]
        patches.spreads_m2[free, k] = patches.spreads_m2[first, k] + share * (
            patches.spreads_m2[second, k] - patches.spreads_m2[first, k]
        )
    patches.counts[free] = a + b
    patches.lengths[free] = patches.lengths[first] + patches.lengths[second]
    patches.noises_m2[free] = patches.noises_m2[first] + share * (patches.noises_m2[second] - patches.noises_m2[first])
    patches.sds_m[free] = max(patches.sds_m[first], patches.sds_m[second])
    choose_normal(patches, free, edge)


@building_block
def _fits(patches: PatchColumns, patch: int, whole: int, tolerance: float, edge: float) -> bool:
    """Return whether a patch's rectangle lies in the plane of the whole."""
    shift, normal = subtract(load(patches.means_m, patch), load(patches.means_m, whole)), normal_of(patches, whole)
    alone = patches.counts[patch] < 2.0
    for corner in range(4):
        # The normal of a single surfel is rough: only its point counts.
        place = shift if alone else add(shift, _corner(patches, patch, corner))
        if abs(dot(place, normal)) > tolerance + 0.1 * edge:
            return False
    return True


@building_block
def _take(
    patches: PatchColumns, patch: int, whole: int, ends: tuple[float, float, float, float], shift: tuple[float, float]
) -> None:
    """Make a patch the whole; its edges stay in line with what they were, and have these ends from its former mean."""
    normal = normal_of(patches, whole)
    u = axis_of(patches, patch, 0)
    u = subtract(u, scale(dot(u, normal), normal))
    length = math.sqrt(dot(u, u))
    u = scale(1.0 / length, u)
    v = normal[1] * u[2] - normal[2] * u[1], normal[2] * u[0] - normal[0] * u[2], normal[0] * u[1] - normal[1] * u[0]
    patches.lows_m[patch, 0], patches.highs_m[patch, 0] = ends[0] + shift[0], ends[1] + shift[0]
    patches.lows_m[patch, 1], patches.highs_m[patch, 1] = ends[2] + shift[1], ends[3] + shift[1]
    patches.counts[patch], patches.lengths[patch] = patches.counts[whole], patches.lengths[whole]
    patches.noises_m2[patch], patches.sds_m[patch] = patches.noises_m2[whole], patches.sds_m[whole]
    for k in range(3):
        patches.means_m[patch, k], patches.normals[patch, k] = patches.means_m[whole, k], patches.normals[whole, k]
        patches.axes[patch, k], patches.axes[patch, 3 + k], patches.axes[patch, 6 + k] = u[k], v[k], normal[k]
    for k in range(6):
        patches.moments_m2[patch, k] = patches.moments_m2[whole, k]
        patches.spreads_m2[patch, k] = patches.spreads_m2[whole, k]
