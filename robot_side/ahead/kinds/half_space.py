"""Half-spaces, solid where normal·x <= offset: normal (3), offset."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.kinds.layout import CLOSING, LEAST_WAY_M, TOUCHING_M, Nearest
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, negative
from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap.closed_forms.half_space import half_space_overlap
from robot_side.overlap.closed_forms.solid import Overlap


def volumes(objects: PerceivedObjects) -> FloatArray:
    """Without end, (p,)."""
    return np.full(len(objects.half_space_offsets_m), np.inf)


@inlined
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """The nearest point of the plane in `row`."""
    normal = shapes[row, 0], shapes[row, 1], shapes[row, 2]
    return dot(normal, point) - shapes[row, 3], negative(normal)


@inlined
def way(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector) -> float:
    """The way at which a sphere that moves along the unit vector `along` touches the plane; inf for never."""
    normal = shapes[row, 0], shapes[row, 1], shapes[row, 2]
    gap, closing = dot(normal, start) - shapes[row, 3] - radius, -dot(normal, along)
    if gap < -TOUCHING_M:
        return 0.0
    return max(gap / closing, LEAST_WAY_M) if closing > CLOSING else math.inf


@inlined
def overlap(shapes: FloatArray, row: int, center: Vector, radius: float) -> Overlap:
    """The exact overlap of a sphere with the half-space in `row` (eq. 12)."""
    return half_space_overlap(center, radius, (shapes[row, 0], shapes[row, 1], shapes[row, 2]), shapes[row, 3])
