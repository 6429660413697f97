"""Pixels that their neighbours support, and the normals of surfaces."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import array_of, compiled, input_array
from robot_side.compiled.vectors import dot, norm, subtract
from robot_side.depth.picture import DepthArray
from robot_side.depth.view import LEAST, MOST, PICTURE, ray_at, sd_at

_NEIGHBOURS: Final = 3
"""Neighbours, of eight, that support a pixel"""
_SIGMAS: Final = 3.0
_SLOPE: Final = 0.01
"""Share of the depth by which neighbours may differ beyond their errors"""
_APART: Final = 2
"""Pixels between a pixel and those from which its normal follows"""
_STEP: Final = 0.03, 0.004
"""Share of the depth, and m, by which these may differ on one surface"""


def supported(depth_m: DepthArray, view: FloatArray) -> DepthArray:
    """Return the depth (h, w) without pixels out of range, and without those that no three neighbours agree with."""
    kept = np.empty_like(depth_m)
    _support(depth_m, view, kept)
    return kept


def normals(depth_m: DepthArray, view: FloatArray) -> DepthArray:
    """Return unit normals (h, w, 3) of the surfaces, towards the camera and in its frame; 0 where unknown."""
    found = np.empty((*depth_m.shape, 3), dtype=np.float32)
    _normals(depth_m, view, found)
    return found


@compiled(PICTURE, input_array(1), array_of(np.float32, 2))
def _support(depth_m: DepthArray, view: FloatArray, kept: DepthArray) -> None:
    height, width = depth_m.shape
    for i in range(height):
        for j in range(width):
            z = depth_m[i, j]
            kept[i, j] = 0.0
            # NaN is in no range.
            if not (view[LEAST] <= z <= view[MOST]):
                continue
            near = np.float32(_SIGMAS * sd_at(view, z) + _SLOPE * z)
            agree = 0
            if 0 < i < height - 1 and 0 < j < width - 1:
                for k in range(-1, 2):
                    agree += (abs(depth_m[i + k, j - 1] - z) <= near) + (abs(depth_m[i + k, j + 1] - z) <= near)
                agree += (abs(depth_m[i - 1, j] - z) <= near) + (abs(depth_m[i + 1, j] - z) <= near)
            else:
                for row in range(max(0, i - 1), min(height, i + 2)):
                    for column in range(max(0, j - 1), min(width, j + 2)):
                        agree += abs(depth_m[row, column] - z) <= near
                agree -= 1
            if agree >= _NEIGHBOURS:
                kept[i, j] = z


@compiled(PICTURE, input_array(1), array_of(np.float32, 3))
def _normals(depth_m: DepthArray, view: FloatArray, found: DepthArray) -> None:
    height, width = depth_m.shape
    for i in range(height):
        for j in range(width):
            found[i, j, 0] = found[i, j, 1] = found[i, j, 2] = 0.0
            z = depth_m[i, j]
            if z <= 0.0 or i < _APART or j < _APART or i >= height - _APART or j >= width - _APART:
                continue
            left, right = depth_m[i, j - _APART], depth_m[i, j + _APART]
            above, below = depth_m[i - _APART, j], depth_m[i + _APART, j]
            step = _STEP[0] * z + _STEP[1]
            far = max(abs(left - z), abs(right - z), abs(above - z), abs(below - z))
            if far > step or min(left, right, above, below) <= 0.0:
                continue
            x, y = ray_at(view, i, j)
            across, down = _APART / view[0], _APART / view[1]
            a = subtract(((x + across) * right, y * right, 1.0 * right), ((x - across) * left, y * left, 1.0 * left))
            b = subtract((x * below, (y + down) * below, 1.0 * below), (x * above, (y - down) * above, 1.0 * above))
            normal = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
            length = norm(normal)
            if length > 0.0:
                by = math.copysign(1.0 / length, -dot(normal, (x, y, 1.0)))
                found[i, j, 0], found[i, j, 1], found[i, j, 2] = by * normal[0], by * normal[1], by * normal[2]
