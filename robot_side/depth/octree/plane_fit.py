"""Whether surfels lie in a plane and fill their rectangle in it."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.stack import on_stack
from robot_side.compiled.vectors import Vector, cross, dot, load, norm, scale, subtract, unit
from robot_side.depth.octree.eigen import principal_axes
from robot_side.depth.octree.patch_columns import PatchColumns
from robot_side.depth.surfel_map.surfel_columns import SurfelColumns

_ROOT3: Final = math.sqrt(3.0)
"""Half a uniform distribution's width, in its standard deviations"""
_REACH: Final = 1.25 * _ROOT3
"""Half of what a surfel fills, in its standard deviations: pixels may be further apart than cells"""
_LINE: Final = 0.4
"""Standard deviation across a patch, in cells, below which its own points do not tell its normal"""
_AGREEING: Final = 0.7
"""Share of the normals' lengths that a plane's own normal must keep"""
_FLAT_M: Final = 0.001
"""Tolerance of a plane, beyond the standard deviation of its pixels"""
_ANGLES: Final = 6
"""Ways in which a rectangle may be turned, over a right angle"""
_CLEARLY: Final = 0.95
"""Area, against that of the ways before, with which a way is better"""
_OTHER_ROLES: Final = 0.1
_RASTER: Final = 32
_new_raster = on_stack(_RASTER, _RASTER, dtype=np.uint8)
_new_matrix, _new_axes = on_stack(3, 3), on_stack(3, 3)


@inlined
def along(six: FloatArray, row: int, a: Vector) -> float:
    """Return the variance along a unit vector of the covariance in a row (xx, yy, zz, xy, xz, yz)."""
    variance: float = (
        six[row, 0] * a[0] * a[0]
        + six[row, 1] * a[1] * a[1]
        + six[row, 2] * a[2] * a[2]
        + 2.0 * (six[row, 3] * a[0] * a[1] + six[row, 4] * a[0] * a[2] + six[row, 5] * a[1] * a[2])
    )
    return variance


@building_block
def sum_up(surfels: SurfelColumns, members: IntArray, start: int, end: int, patches: PatchColumns, patch: int) -> None:
    """Write the moments of some surfels into the row of a patch."""
    count = 1.0 * (end - start)
    for k in range(3):
        patches.means_m[patch, k] = patches.normals[patch, k] = 0.0
    for k in range(6):
        patches.moments_m2[patch, k] = patches.spreads_m2[patch, k] = 0.0
    length = noise = sd = 0.0
    role, votes = -1, 0
    for place in range(start, end):
        row = members[place]
        for k in range(3):
            patches.means_m[patch, k] += surfels.points_m[row, k] / count
            patches.normals[patch, k] += surfels.normals[row, k]
        for k in range(6):
            patches.spreads_m2[patch, k] += surfels.spreads_m2[row, k] / count
        length += norm(load(surfels.normals, row))
        noise += surfels.noise_m2[row] / count
        sd = max(sd, surfels.sds_m[row])
        if votes == 0:
            role = surfels.roles[row]
        votes += 1 if surfels.roles[row] == role else -1
    mean = load(patches.means_m, patch)
    for place in range(start, end):
        x, y, z = subtract(load(surfels.points_m, members[place]), mean)
        patches.moments_m2[patch, 0] += x * x / count
        patches.moments_m2[patch, 1] += y * y / count
        patches.moments_m2[patch, 2] += z * z / count
        patches.moments_m2[patch, 3] += x * y / count
        patches.moments_m2[patch, 4] += x * z / count
        patches.moments_m2[patch, 5] += y * z / count
    patches.counts[patch], patches.lengths[patch] = count, length
    patches.noises_m2[patch], patches.sds_m[patch], patches.roles[patch] = noise, sd, role


@building_block
def choose_normal(patches: PatchColumns, patch: int, edge: float) -> None:
    """Write the normal of a patch, towards free space, and along its length another axis, into its axes."""
    matrix, axes = _new_matrix(), _new_axes()
    for k in range(3):
        matrix[k, k] = patches.moments_m2[patch, k] + patches.spreads_m2[patch, k]
    for i, j, k in ((0, 1, 3), (0, 2, 4), (1, 2, 5)):
        matrix[i, j] = matrix[j, i] = patches.moments_m2[patch, k] + patches.spreads_m2[patch, k]
    principal_axes(matrix, axes)
    rough = unit(load(patches.normals, patch))
    long = axes[0, 2], axes[1, 2], axes[2, 2]
    normal = axes[0, 0], axes[1, 0], axes[2, 0]
    if patches.counts[patch] < 3.0 or matrix[1, 1] < (_LINE * edge) ** 2:
        normal = rough
        if matrix[2, 2] > (_LINE * edge) ** 2:
            normal = unit(subtract(rough, scale(dot(rough, long), long)))
        if norm(normal) == 0.0:
            normal = axes[0, 0], axes[1, 0], axes[2, 0]
    if dot(normal, rough) < 0.0:
        normal = scale(-1.0, normal)
    long = unit(subtract(long, scale(dot(long, normal), normal)))
    for k in range(3):
        patches.axes[patch, k], patches.axes[patch, 6 + k] = long[k], normal[k]


@inlined
def normal_of(patches: PatchColumns, patch: int) -> Vector:
    """Return the normal of a patch."""
    return patches.axes[patch, 6], patches.axes[patch, 7], patches.axes[patch, 8]


@building_block
def measure_rise(patches: PatchColumns, patch: int, edge: float) -> None:
    """Write how far before its mean the patch's foremost is: as a cap's or a rod's, from its variance but for noise."""
    normal = normal_of(patches, patch)
    variance = along(patches.moments_m2, patch, normal) + along(patches.spreads_m2, patch, normal)
    patches.rises_m[patch] = min(_ROOT3 * math.sqrt(max(variance - patches.noises_m2[patch], 0.0)), 0.5 * edge)


@building_block
def is_flat(
    surfels: SurfelColumns,
    members: IntArray,
    start: int,
    end: int,
    patches: PatchColumns,
    patch: int,
    edge: float,
    lenience: float,
) -> bool:
    """Return whether surfels lie in their patch's plane. lenience: factor on the tolerance."""
    normal, mean = normal_of(patches, patch), load(patches.means_m, patch)
    tolerance = lenience * (_FLAT_M + patches.sds_m[patch])
    if along(patches.moments_m2, patch, normal) > (0.5 * tolerance) ** 2:
        return False
    if dot(load(patches.normals, patch), normal) < _AGREEING * patches.lengths[patch]:
        return False
    others = 0
    for place in range(start, end):
        row = members[place]
        if abs(dot(subtract(load(surfels.points_m, row), mean), normal)) > tolerance + 0.1 * lenience * edge:
            return False
        others += surfels.roles[row] != patches.roles[patch]
    return others <= _OTHER_ROLES * (end - start)


@building_block
def lay_rectangle(
    surfels: SurfelColumns, members: IntArray, start: int, end: int, patches: PatchColumns, patch: int
) -> None:
    """Write the axes and ends of the smallest rectangle around surfels, of a few ways in which it may be turned."""
    normal, mean = normal_of(patches, patch), load(patches.means_m, patch)
    long = patches.axes[patch, 0], patches.axes[patch, 1], patches.axes[patch, 2]
    x, y, z = abs(normal[0]), abs(normal[1]), abs(normal[2])
    side = (1.0, 0.0, 0.0) if x <= y and x <= z else ((0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0))
    base = unit(subtract(side, scale(dot(side, normal), normal)))
    other = cross(normal, base)
    least = math.inf
    for way in range(_ANGLES + 1):
        angle = 0.5 * math.pi * way / _ANGLES
        c, s = math.cos(angle), math.sin(angle)
        u = c * base[0] + s * other[0], c * base[1] + s * other[1], c * base[2] + s * other[2]
        if way == _ANGLES:
            u = long
        v = cross(normal, u)
        low_u = low_v = math.inf
        high_u = high_v = -math.inf
        for place in range(start, end):
            row = members[place]
            away = subtract(load(surfels.points_m, row), mean)
            a, b = dot(away, u), dot(away, v)
            p = _ROOT3 * math.sqrt(max(along(surfels.spreads_m2, row, u), 0.0))
            q = _ROOT3 * math.sqrt(max(along(surfels.spreads_m2, row, v), 0.0))
            low_u, high_u = min(low_u, a - p), max(high_u, a + p)
            low_v, high_v = min(low_v, b - q), max(high_v, b + q)
        area = (high_u - low_u) * (high_v - low_v)
        if area < _CLEARLY * least:
            least = area
            for k in range(3):
                patches.axes[patch, k], patches.axes[patch, 3 + k] = u[k], v[k]
            patches.lows_m[patch, 0], patches.lows_m[patch, 1] = low_u, low_v
            patches.highs_m[patch, 0], patches.highs_m[patch, 1] = high_u, high_v


@building_block
def is_filled(
    surfels: SurfelColumns,
    members: IntArray,
    start: int,
    end: int,
    patches: PatchColumns,
    patch: int,
    edge: float,
    lenience: float,
) -> bool:
    """Return whether surfels fill their patch's rectangle, but for a thirtieth of its cells, times the lenience."""
    raster, mean = _new_raster(), load(patches.means_m, patch)
    u = patches.axes[patch, 0], patches.axes[patch, 1], patches.axes[patch, 2]
    v = patches.axes[patch, 3], patches.axes[patch, 4], patches.axes[patch, 5]
    left, low = patches.lows_m[patch, 0], patches.lows_m[patch, 1]
    width, height = patches.highs_m[patch, 0] - left, patches.highs_m[patch, 1] - low
    across = min(max(math.ceil(width / edge - 0.2), 1), _RASTER)
    up = min(max(math.ceil(height / edge - 0.2), 1), _RASTER)
    for i in range(across):
        for j in range(up):
            raster[i, j] = 0
    empty = across * up
    for place in range(start, end):
        row = members[place]
        away = subtract(load(surfels.points_m, row), mean)
        a, b = dot(away, u) - left, dot(away, v) - low
        p = _REACH * math.sqrt(max(along(surfels.spreads_m2, row, u), 0.0)) + 0.25 * edge
        q = _REACH * math.sqrt(max(along(surfels.spreads_m2, row, v), 0.0)) + 0.25 * edge
        # A cell of the raster is filled if its middle is.
        first, last = math.ceil((a - p) * across / width - 0.5), math.floor((a + p) * across / width - 0.5)
        lowest, top = math.ceil((b - q) * up / height - 0.5), math.floor((b + q) * up / height - 0.5)
        for i in range(max(first, 0), min(last, across - 1) + 1):
            for j in range(max(lowest, 0), min(top, up - 1) + 1):
                empty -= raster[i, j] == 0
                raster[i, j] = 1
    filled: bool = empty * 30.0 <= lenience * across * up
    return filled
