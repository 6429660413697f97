"""Contact of a moving sphere with a convex primitive, from its function `nearest` (conservative advancement)."""

from collections.abc import Callable
from typing import Any

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block
from robot_side.compiled.vectors import Vector, add, dot, scale
from robot_side.surroundings.kinds.layout import CLOSING, LEAST_CONTACT_M, MOST_STEPS, NEVER, TOUCHING_M, Contact


def convex_contact(nearest: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function `contact` of a kind, built from its `nearest` (see `Kind`)."""

    @building_block
    def contact(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float) -> Contact:
        # Each step ends at the tangent plane at the primitive's nearest point.
        moved, point = 0.0, start
        for _ in range(MOST_STEPS):
            distance, towards = nearest(shapes, row, point)
            gap = distance - radius
            if gap < -TOUCHING_M:
                return moved, 1.0
            closing = dot(towards, along)
            if closing <= CLOSING:
                return NEVER
            if gap <= TOUCHING_M:
                return max(moved, LEAST_CONTACT_M), closing
            step = gap / closing
            moved += step
            if moved > reach:
                return NEVER
            point = add(point, scale(step, along))
        # A sphere that still moves grazes the primitive: it has not touched up to here.
        return moved, 1.0

    return contact
