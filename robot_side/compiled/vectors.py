"""Vectors of three numbers as tuples, which Numba keeps in registers; it would put small arrays on the heap."""

import math

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined

Vector = tuple[float, float, float]


@inlined
def load(array: FloatArray, row: int) -> Vector:
    """Return row `row` of an (n, 3) array."""
    return array[row, 0], array[row, 1], array[row, 2]


@inlined
def add(a: Vector, b: Vector) -> Vector:
    """Return the sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def subtract(a: Vector, b: Vector) -> Vector:
    """Return the difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def negative(a: Vector) -> Vector:
    """Return -a."""
    return -a[0], -a[1], -a[2]


@inlined
def scale(factor: float, a: Vector) -> Vector:
    """Return the product factor · a."""
    return factor * a[0], factor * a[1], factor * a[2]


@inlined
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def norm(a: Vector) -> float:
    """Return the length |a|."""
    return math.sqrt(dot(a, a))


@inlined
def unit(a: Vector) -> Vector:
    """Return the direction a / |a|; 0 if |a| is 0 or underflows to it."""
    length = norm(a)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return a[0] / length, a[1] / length, a[2] / length
