"""Bounding spheres of primitives, objects and blocks, and a test whether a swept sphere touches one (broad phase)."""

import math
from typing import Final

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, add, dot, load, norm, scale, subtract

_ENLARGED: Final = 1.0 + 1e-9
"""Bounds are enlarged by this factor, so that rounding never passes over a contact."""


@inlined
def passes(center: Vector, along: Vector, reach: float, bounds: FloatArray, row: int, radius: float) -> bool:
    """Return whether a sphere swept by `reach` along the unit vector `along` touches the bounding sphere in `row`."""
    if not bounds[row, 3] >= 0.0:
        return False
    offset = subtract(load(bounds, row), center)
    part = min(max(dot(offset, along), 0.0), reach)
    apart = subtract(offset, scale(part, along))
    most: float = (bounds[row, 3] + radius) * _ENLARGED
    return dot(apart, apart) <= most * most


@inlined
def around(bounds: FloatArray, first: int, end: int) -> tuple[Vector, float]:
    """Return centre and radius of a sphere around the bounding spheres in the rows `first` to `end` - 1.

    The radius is -inf without rows, and inf if one of the bounding spheres is infinite. bounds (n, 4): centres and
    radii.
    """
    low, high, middle = (math.inf, math.inf, math.inf), (-math.inf, -math.inf, -math.inf), (0.0, 0.0, 0.0)
    for row in range(first, end):
        x, y, z, size = bounds[row, 0], bounds[row, 1], bounds[row, 2], bounds[row, 3]
        low = min(low[0], x - size), min(low[1], y - size), min(low[2], z - size)
        high = max(high[0], x + size), max(high[1], y + size), max(high[2], z + size)
    if first < end and high[0] < math.inf:
        middle = scale(0.5, add(low, high))
    radius = -math.inf
    for row in range(first, end):
        radius = max(radius, norm(subtract(load(bounds, row), middle)) + bounds[row, 3])
    return middle, radius


@inlined
def write_around(bounds: FloatArray, first: int, end: int, written: FloatArray) -> None:
    """Write the centre and radius that `around` returns into `written` (4,)."""
    middle, radius = around(bounds, first, end)
    written[0], written[1], written[2], written[3] = middle[0], middle[1], middle[2], radius
