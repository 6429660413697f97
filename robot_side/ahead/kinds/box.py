"""Boxes {c + Q diag(half) x : |x_i| <= 1}: centre (3), Q by rows (9), half sizes (3)."""

import math

from common.arrays import FloatArray
from robot_side.ahead.kinds.layout import CLOSING, LEAST_WAY_M, MOST_STEPS, TOUCHING_M, Nearest
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, dot, norm, scale, subtract
from robot_side.objects.perceived import PerceivedObjects


def volumes(objects: PerceivedObjects) -> FloatArray:
    """Volumes (b,) in m³."""
    found: FloatArray = 8.0 * objects.box_half_sizes_m.prod(axis=1)
    return found


@inlined
def _axis(shapes: FloatArray, row: int, k: int) -> Vector:
    """The unit vector along the box's edge k: a column of Q."""
    return shapes[row, 3 + k], shapes[row, 6 + k], shapes[row, 9 + k]


@inlined
def _along(shapes: FloatArray, row: int, k: int, point: Vector) -> float:
    """How far `point` lies from the centre along edge k."""
    return dot(_axis(shapes, row, k), subtract(point, (shapes[row, 0], shapes[row, 1], shapes[row, 2])))


@building_block
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """The nearest point of the surface of the box in `row`; from inside that of the nearest face."""
    local = _along(shapes, row, 0, point), _along(shapes, row, 1, point), _along(shapes, row, 2, point)
    beyond = abs(local[0]) - shapes[row, 12], abs(local[1]) - shapes[row, 13], abs(local[2]) - shapes[row, 14]
    excess = max(beyond[0], 0.0), max(beyond[1], 0.0), max(beyond[2], 0.0)
    distance = norm(excess)
    if distance > 0.0:
        towards = 0.0, 0.0, 0.0
        for k in range(3):
            towards = add(towards, scale(math.copysign(excess[k] / distance, -local[k]), _axis(shapes, row, k)))
        return distance, towards
    face = 0
    for k in (1, 2):
        if beyond[k] > beyond[face]:
            face = k
    return beyond[face], scale(math.copysign(1.0, -local[face]), _axis(shapes, row, face))


@building_block
def way(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float) -> float:
    """The way at which a sphere that moves along the unit vector `along` first touches the box; inf beyond the reach.

    In the box's own frame: each step ends at the plane that touches the box at its nearest point.
    """
    x, y, z = _along(shapes, row, 0, start), _along(shapes, row, 1, start), _along(shapes, row, 2, start)
    u, v, w = (
        dot(_axis(shapes, row, 0), along),
        dot(_axis(shapes, row, 1), along),
        dot(_axis(shapes, row, 2), along),
    )
    a, b, c = shapes[row, 12], shapes[row, 13], shapes[row, 14]
    moved = 0.0
    for _ in range(MOST_STEPS):
        # From the nearest point of the box to the centre.
        i, j, k = x - min(max(x, -a), a), y - min(max(y, -b), b), z - min(max(z, -c), c)
        distance = math.sqrt(i * i + j * j + k * k)
        gap = distance - radius
        if gap < -TOUCHING_M:
            return moved
        closing = -(i * u + j * v + k * w)
        if closing <= CLOSING * distance:
            return math.inf
        if gap <= TOUCHING_M:
            return max(moved, LEAST_WAY_M)
        step = gap * distance / closing
        moved += step
        if moved > reach:
            return math.inf
        x, y, z = x + step * u, y + step * v, z + step * w
    # What still moves grazes: so far it has not touched.
    return moved
