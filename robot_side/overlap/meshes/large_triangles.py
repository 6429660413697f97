"""Corrections for triangles much larger than the ball, whose corners are far away and so have large rounding errors.

The foot points of their edges, and their heights, are recomputed in double-double arithmetic.
"""

import math

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, cross, dot, norm, scale
from robot_side.overlap.digits.double_double import divided
from robot_side.overlap.digits.double_double_vectors import (
    PreciseVector,
    highs,
    precise_cross,
    precise_dot,
    precise_scale,
    precise_subtract,
)
from robot_side.overlap.meshes.mesh_tables import MeshTables
from robot_side.overlap.meshes.triangle_lanes import BASES, CORNER_DISTANCES, DISTANCES, HEIGHT, HEIGHTS, ROW, aside

FAR = 3.0
"""Distance from the centre, in radii: an edge is recomputed if both ends are farther"""
_VANISHED = 1e-28
"""Distance of a foot point from the centre, as a share of an end's distance, up to which it is only a rounding error"""

PreciseTriangle = tuple[PreciseVector, PreciseVector, PreciseVector]


@inlined
def corners_about(tables: MeshTables, triangle: int, center: PreciseVector) -> PreciseTriangle:
    """Return a triangle's corners relative to the centre (m)."""
    row = tables.triangles[triangle]
    return (
        precise_subtract(((row[0], 0.0), (row[1], 0.0), (row[2], 0.0)), center),
        precise_subtract(((row[3], 0.0), (row[4], 0.0), (row[5], 0.0)), center),
        precise_subtract(((row[6], 0.0), (row[7], 0.0), (row[8], 0.0)), center),
    )


@inlined
def is_far(scratch: FloatArray, lane: int) -> bool:
    """Return whether the triangle in a lane has an edge with both ends farther than `FAR` from the centre."""
    far = 0
    for corner in range(3):
        far += 1 if scratch[CORNER_DISTANCES + corner * ROW + lane] > FAR else 0
    return far > 1


@building_block
def refine_lane(
    scratch: FloatArray, lane: int, tables: MeshTables, triangle: int, center: PreciseVector, radius: float
) -> None:
    """Recompute `HEIGHTS` to `BASES` of a lane's far edges, and take `HEIGHT` from the edge nearest to the centre.

    If no edge reaches the ball, `HEIGHT` is computed from the triangle's plane.
    """
    corners = corners_about(tables, triangle, center)
    row = tables.triangles[triangle]
    normal = row[9], row[10], row[11]
    closest = math.inf
    for edge in range(3):
        start, end = corners[edge], corners[(edge + 1) % 3]
        near = start if _rank(highs(start)) < _rank(highs(end)) else end
        if dot(highs(near), highs(near)) > FAR * FAR * radius * radius:
            along = precise_subtract(end, start)
            factor = divided(precise_dot(along, near), precise_dot(along, along))
            foot = highs(precise_subtract(near, precise_scale(factor, along)))
            direction, least = scale(row[12 + edge], highs(along)), _VANISHED * norm(highs(near))
            place = scale(1.0 / radius, foot) if norm(foot) > least else aside(direction)
            scratch[HEIGHTS + edge * ROW + lane] = dot(normal, place)
            scratch[DISTANCES + edge * ROW + lane] = dot(cross(direction, normal), place)
            scratch[BASES + edge * ROW + lane] = norm(place)
        if scratch[BASES + edge * ROW + lane] < closest:
            closest = scratch[BASES + edge * ROW + lane]
            scratch[HEIGHT + lane] = scratch[HEIGHTS + edge * ROW + lane]
    if closest >= 1.0:
        crossed = precise_cross(precise_subtract(corners[1], corners[0]), precise_subtract(corners[2], corners[0]))
        size = norm(highs(crossed))
        if size > 0.0:
            scratch[HEIGHT + lane] = precise_dot(crossed, corners[0])[0] / (size * radius)


@inlined
def _rank(corner: Vector) -> float:
    """Return a rank, lower for nearer corners. The ends of an edge differ in rank, even if they are equally near.

    So an edge and its reverse choose the same end.
    """
    return dot(corner, corner) * (1.0 + 1e-9 * math.tanh(corner[0] + 0.73 * corner[1] + 0.29 * corner[2]))
