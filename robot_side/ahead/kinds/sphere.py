"""Spheres: centre (3), radius."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.kinds.layout import ANY_DIRECTION, LEAST_WAY_M, TOUCHING_M, Nearest
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, norm, subtract, unit
from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap.closed_forms.ball import sphere_overlap
from robot_side.overlap.closed_forms.solid import Overlap


def volumes(objects: PerceivedObjects) -> FloatArray:
    """Volumes (s,) in m³."""
    found: FloatArray = 4.0 / 3.0 * np.pi * objects.sphere_radii_m**3
    return found


@inlined
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """The nearest point of the sphere in `row`."""
    offset = subtract((shapes[row, 0], shapes[row, 1], shapes[row, 2]), point)
    length = norm(offset)
    return length - shapes[row, 3], unit(offset) if length > 0.0 else ANY_DIRECTION


@inlined
def way(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector) -> float:
    """The way at which a sphere that moves along the unit vector `along` touches the one in `row`; inf for never."""
    offset = subtract((shapes[row, 0], shapes[row, 1], shapes[row, 2]), start)
    reach = shapes[row, 3] + radius
    ahead, apart = dot(offset, along), dot(offset, offset) - reach * reach
    if apart < -2.0 * reach * TOUCHING_M:
        return 0.0
    inside = ahead * ahead - apart
    if ahead <= 0.0 or inside < 0.0:
        return math.inf
    found: float = max(apart / (ahead + math.sqrt(inside)), LEAST_WAY_M)
    return found


@inlined
def overlap(shapes: FloatArray, row: int, center: Vector, radius: float) -> Overlap:
    """The exact overlap of a sphere with the one in `row` (eq. 11)."""
    return sphere_overlap(center, radius, (shapes[row, 0], shapes[row, 1], shapes[row, 2]), shapes[row, 3])
