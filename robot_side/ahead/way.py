"""How far a sphere goes along a direction until it touches a convex primitive."""

from typing import Final

from common.arrays import FloatArray
from robot_side.ahead.kinds import box, half_space, sphere, tetrahedron
from robot_side.ahead.kinds.layout import BOX, MESH, SPHERE, TETRAHEDRON, Nearest
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, dot, load, scale, subtract

_REACH: Final = 1.0 + 1e-9
"""Bounds are enlarged by this, so that rounding never passes over what is touched."""


@inlined
def passes(center: Vector, along: Vector, reach: float, bounds: FloatArray, row: int, radius: float) -> bool:
    """Whether a sphere that is swept by `reach` comes as near as its radius to the bounding sphere in `row`."""
    if not bounds[row, 3] >= 0.0:
        return False
    offset = subtract(load(bounds, row), center)
    part = min(max(dot(offset, along), 0.0), reach)
    apart = subtract(offset, scale(part, along))
    most: float = (bounds[row, 3] + radius) * _REACH
    return dot(apart, apart) <= most * most


@building_block
def nearest(kind: int, shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """The nearest point of the primitive in `row`, of any kind but a mesh."""
    if kind == BOX:
        return box.nearest(shapes, row, point)
    if kind == TETRAHEDRON:
        return tetrahedron.nearest(shapes, row, point)
    if kind == SPHERE:
        return sphere.nearest(shapes, row, point)
    return half_space.nearest(shapes, row, point)


@building_block
def way_to(kind: int, shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float) -> float:
    """The way at which a sphere that moves along the unit vector `along` first touches; 0 where it does, else inf.

    To a mesh: to the box around it, which is no longer.
    """
    if kind in (BOX, MESH):
        return box.way(shapes, row, start, radius, along, reach)
    if kind == TETRAHEDRON:
        return tetrahedron.way(shapes, row, start, radius, along, reach)
    if kind == SPHERE:
        return sphere.way(shapes, row, start, radius, along)
    return half_space.way(shapes, row, start, radius, along)
