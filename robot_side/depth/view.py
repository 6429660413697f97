"""What kernels need to know of a camera, as one array: intrinsics, pose and errors."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import array_of, inlined
from robot_side.compiled.vectors import Vector
from robot_side.depth.picture import CameraPose, DepthErrors, Pinhole

PICTURE: Final = array_of(np.float32, 2, read_only=True)
"""Numba type of a depth picture (h, w) that a kernel reads"""
DIRECTIONS: Final = array_of(np.float32, 3, read_only=True)
"""Numba type of directions (h, w, 3) that a kernel reads"""
MASK: Final = array_of(np.uint8, 2, read_only=True)
"""Numba type of a mask (h, w) that a kernel reads"""

_ROTATION: Final = 4
_POSITION: Final = 13
_GROWTH: Final = 16
_FLOOR: Final = 17
LEAST: Final = 18
"""Index of the least measured depth in a view's numbers"""
MOST: Final = 19
"""Index of the largest measured depth"""


def view_of(pinhole: Pinhole, pose: CameraPose, errors: DepthErrors) -> FloatArray:
    """Return the numbers (20,) of a view."""
    return np.array(
        [
            *(pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy, *np.ravel(pose.rotation), *pose.position_m),
            *(errors.growth_per_m, errors.floor_m, errors.least_m, errors.most_m),
        ]
    )


@inlined
def sd_at(view: FloatArray, depth_m: float) -> float:
    """Return the standard deviation in m of a pixel at this depth."""
    sd_m: float = view[_FLOOR] + view[_GROWTH] * depth_m * depth_m
    return sd_m


@inlined
def ray_at(view: FloatArray, row: int, column: int) -> tuple[float, float]:
    """Return x / z and y / z of what a pixel shows, in the camera's frame."""
    return (column + 0.5 - view[2]) / view[0], (row + 0.5 - view[3]) / view[1]


@inlined
def turned_to_world(view: FloatArray, a: Vector) -> Vector:
    """Return a camera's vector in the world frame."""
    return (
        view[_ROTATION] * a[0] + view[_ROTATION + 1] * a[1] + view[_ROTATION + 2] * a[2],
        view[_ROTATION + 3] * a[0] + view[_ROTATION + 4] * a[1] + view[_ROTATION + 5] * a[2],
        view[_ROTATION + 6] * a[0] + view[_ROTATION + 7] * a[1] + view[_ROTATION + 8] * a[2],
    )


@inlined
def to_world(view: FloatArray, a: Vector) -> Vector:
    """Return a camera's point in the world frame."""
    x, y, z = turned_to_world(view, a)
    return x + view[_POSITION], y + view[_POSITION + 1], z + view[_POSITION + 2]


@inlined
def to_camera(view: FloatArray, a: Vector) -> Vector:
    """Return a point of the world in the camera's frame."""
    x, y, z = a[0] - view[_POSITION], a[1] - view[_POSITION + 1], a[2] - view[_POSITION + 2]
    return (
        view[_ROTATION] * x + view[_ROTATION + 3] * y + view[_ROTATION + 6] * z,
        view[_ROTATION + 1] * x + view[_ROTATION + 4] * y + view[_ROTATION + 7] * z,
        view[_ROTATION + 2] * x + view[_ROTATION + 5] * y + view[_ROTATION + 8] * z,
    )


@inlined
def pixel_of(view: FloatArray, a: Vector) -> tuple[int, int]:
    """Return row and column at which a camera's point ahead of it appears; they may lie outside the picture."""
    return math.floor(view[1] * a[1] / a[2] + view[3]), math.floor(view[0] * a[0] / a[2] + view[2])


@inlined
def camera_position(view: FloatArray) -> Vector:
    """Return where the camera is, in the world frame."""
    return view[_POSITION], view[_POSITION + 1], view[_POSITION + 2]


@inlined
def pixels_across(view: FloatArray, length_m: float, depth_m: float) -> float:
    """Return how many pixels a length square to the view has at a depth."""
    pixels: float = view[0] * length_m / depth_m
    return pixels
