"""Pixels that show the robot itself, or what it holds."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import (
    FLOAT64,
    array_of,
    building_block,
    compiled,
    input_array,
    input_indices,
    output_array,
    output_indices,
)
from robot_side.compiled.vectors import Vector, load, norm, subtract
from robot_side.depth.picture import BOX, CAPSULE, CYLINDER, ELLIPSOID, DepthArray, LabelArray, OwnBody
from robot_side.depth.view import MASK, PICTURE, pixel_of, pixels_across, ray_at, to_camera, to_world

_GROWN: Final = 2
"""Pixels by which the robot's picture is grown: edges of objects smear"""
HELD_M: Final = 0.05
"""Distance from what is known of a held object within which its surface is followed"""
_STEP: Final = 2.0
"""Difference of two neighbours' depths, in their distance, up to which a surface goes on: 63 degrees"""


def own_pixels(depth_m: DepthArray, view: FloatArray, body: OwnBody, padding_m: float) -> LabelArray:
    """Return a mask (h, w): 1 where a pixel shows a point within `padding_m` of the body, or is 2 pixels from such.

    What is held was seen from one side before the grip. So what continues its surface within HELD_M is its own, too.
    """
    own, grown = np.zeros(depth_m.shape, dtype=np.uint8), np.zeros(depth_m.shape, dtype=np.uint8)
    _mark(depth_m, view, *_solids(body), padding_m, own)
    if body.held:
        held, carried = np.zeros(depth_m.shape, dtype=np.uint8), body.carried()
        _mark(depth_m, view, *_solids(carried), padding_m, held)
        middle_m = carried.positions_m.mean(axis=0)
        reach_m = np.linalg.norm(carried.positions_m - middle_m, axis=1).max() + carried.sizes_m.max() + HELD_M
        _follow_surface(depth_m, view, np.array([*middle_m, reach_m]), np.empty(own.size, dtype=np.int64), held)
        own |= held
    _grow(own, grown)
    return grown


def _solids(body: OwnBody) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    positions_m, rotations, sizes_m = map(np.ascontiguousarray, (body.positions_m, body.rotations, body.sizes_m))
    return np.ascontiguousarray(body.kinds), positions_m, rotations, sizes_m


def beyond_m(points_m: FloatArray, body: OwnBody) -> FloatArray:
    """Return the signed distances (n,) of points (n, 3) from the surface of the union of the solids; inside below 0.

    For ellipsoids, and inside several solids at once, the amount is at most the true one.
    """
    found = np.full(len(points_m), math.inf)
    _find_beyond(np.ascontiguousarray(points_m), *_solids(body), found)
    return found


@compiled(
    *(input_array(2), input_indices(), input_array(2), input_array(3), input_array(2)),
    output_array(1),
)
def _find_beyond(
    points_m: FloatArray,
    kinds: IntArray,
    positions_m: FloatArray,
    rotations: FloatArray,
    sizes_m: FloatArray,
    found: FloatArray,
) -> None:
    for n in range(found.size):
        for k in range(kinds.size):
            away = subtract(load(points_m, n), load(positions_m, k))
            found[n] = min(found[n], _beyond(kinds[k], load(sizes_m, k), _turned(rotations, k, away)))


@building_block
def _turned(rotations: FloatArray, k: int, a: Vector) -> Vector:
    """Return a vector of the world in the frame of solid k."""
    u, v, w = a
    return (
        rotations[k, 0, 0] * u + rotations[k, 1, 0] * v + rotations[k, 2, 0] * w,
        rotations[k, 0, 1] * u + rotations[k, 1, 1] * v + rotations[k, 2, 1] * w,
        rotations[k, 0, 2] * u + rotations[k, 1, 2] * v + rotations[k, 2, 2] * w,
    )


@building_block
def _beyond(kind: int, size: Vector, point: Vector) -> float:
    """Return a point's distance from a solid in the solid's frame, inside below 0; of ellipsoids at most as much."""
    x, y, z = abs(point[0]), abs(point[1]), abs(point[2])
    if kind == BOX:
        return _beyond_box((x - size[0], y - size[1], z - size[2]))
    if kind == CAPSULE:
        return norm((x, y, max(z - size[1], 0.0))) - size[0]
    if kind == CYLINDER:
        across, along = math.sqrt(x * x + y * y) - size[0], z - size[1]
        return _beyond_box((across, along, min(across, along, 0.0)))
    if kind == ELLIPSOID:
        # Along the way to the centre the surface is further than across it by at most the ratio of the axes.
        length = norm((x / size[0], y / size[1], z / size[2]))
        return (length - 1.0) * min(size[0], size[1], size[2])
    return norm((x, y, z)) - size[0]


@building_block
def _beyond_box(over: Vector) -> float:
    x, y, z = over
    return norm((max(x, 0.0), max(y, 0.0), max(z, 0.0))) + min(max(x, y, z), 0.0)


@building_block
def _radius(kind: int, size: Vector) -> float:
    """Return the radius of the sphere around a solid."""
    if kind == BOX:
        return norm(size)
    if kind == CAPSULE:
        return size[0] + size[1]
    if kind == CYLINDER:
        return math.sqrt(size[0] * size[0] + size[1] * size[1])
    if kind == ELLIPSOID:
        return max(size[0], size[1], size[2])
    return size[0]


@compiled(
    *(PICTURE, input_array(1), input_indices(), input_array(2), input_array(3), input_array(2), FLOAT64),
    array_of(np.uint8, 2),
)
def _mark(
    depth_m: DepthArray,
    view: FloatArray,
    kinds: IntArray,
    positions_m: FloatArray,
    rotations: FloatArray,
    sizes_m: FloatArray,
    padding_m: float,
    own: LabelArray,
) -> None:
    height, width = depth_m.shape
    for k in range(kinds.size):
        size, center = load(sizes_m, k), load(positions_m, k)
        reach = _radius(kinds[k], size) + padding_m
        x, y, z = to_camera(view, center)
        if z + reach <= 0.0:
            continue
        top, left, bottom, right = 0, 0, height - 1, width - 1
        if z - reach > 1e-3:
            # Corners of a square around the sphere, at its nearest and its furthest depth.
            near, far = z - reach, z + reach
            a, b = pixel_of(
                view, (min((x - reach) / near, (x - reach) / far), min((y - reach) / near, (y - reach) / far), 1.0)
            )
            c, d = pixel_of(
                view, (max((x + reach) / near, (x + reach) / far), max((y + reach) / near, (y + reach) / far), 1.0)
            )
            top, left, bottom, right = max(a, 0), max(b, 0), min(c, bottom), min(d, right)
        for i in range(top, bottom + 1):
            for j in range(left, right + 1):
                depth = depth_m[i, j]
                if depth <= 0.0 or own[i, j] or abs(depth - z) > reach:
                    continue
                across, down = ray_at(view, i, j)
                u, v, w = subtract(to_world(view, (across * depth, down * depth, 1.0 * depth)), center)
                if u * u + v * v + w * w > reach * reach:
                    continue
                if _beyond(kinds[k], size, _turned(rotations, k, (u, v, w))) <= padding_m:
                    own[i, j] = 1


@compiled(MASK, array_of(np.uint8, 2))
def _grow(own: LabelArray, grown: LabelArray) -> None:
    height, width = own.shape
    for i in range(height):
        for j in range(width):
            if own[i, j]:
                for row in range(max(0, i - _GROWN), min(height, i + _GROWN + 1)):
                    for column in range(max(0, j - _GROWN), min(width, j + _GROWN + 1)):
                        grown[row, column] = 1


@compiled(PICTURE, input_array(1), input_array(1), output_indices(), array_of(np.uint8, 2))
def _follow_surface(
    depth_m: DepthArray, view: FloatArray, ball: FloatArray, waiting: IntArray, held: LabelArray
) -> None:
    """Add to the mask all pixels that continue the surfaces in it, within a ball: middle (3) and radius."""
    height, width = depth_m.shape
    count, middle = 0, (ball[0], ball[1], ball[2])
    for i in range(height):
        for j in range(width):
            if held[i, j]:
                waiting[count] = i * width + j
                count += 1
    while count > 0:
        count -= 1
        row, column = waiting[count] // width, waiting[count] % width
        here = depth_m[row, column]
        for side in range(4):
            i, j = row + (side == 0) - (side == 1), column + (side == 2) - (side == 3)
            if i < 0 or j < 0 or i >= height or j >= width or held[i, j] or depth_m[i, j] <= 0.0:
                continue
            depth = 1.0 * depth_m[i, j]
            if abs(depth - here) * pixels_across(view, 1.0, depth) > _STEP:
                continue
            across, down = ray_at(view, i, j)
            if norm(subtract(to_world(view, (across * depth, down * depth, depth)), middle)) <= ball[3]:
                held[i, j] = 1
                waiting[count] = i * width + j
                count += 1
