"""Overlap of a sphere and a closed mesh with an error of 1e-13 of the sphere, for the law.

The steps of `mesh_overlap` for further digits are left out.
"""

import math

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, dot, scale, subtract
from robot_side.overlap.meshes.mesh_overlap import NO_SUMS, box_distances_2, measured, solid_angle_inside, with_lanes
from robot_side.overlap.meshes.mesh_tables import MeshTables
from robot_side.overlap.meshes.tree_queries import corner_of, gather_near, is_inside, squared_distance
from robot_side.overlap.meshes.triangle_lanes import LANES
from robot_side.overlap.solids.half_space import cap
from robot_side.overlap.solids.solid import bounded, sphere_volume

_SAME_PLANE = 1e-9
"""Largest difference of the unit normals, and of the distances in radii, of two triangles that count as in one plane"""


@building_block
def rounded_overlap(
    center: Vector, radius: float, tables: MeshTables, mesh: int, near: IntArray, scratch: FloatArray
) -> tuple[float, Vector]:
    """Return (volume, gradient) of the overlap; the arguments are those of `mesh_overlap`, with a rounded centre."""
    least_2, most_2 = box_distances_2(tables, mesh, center)
    if least_2 >= radius * radius or radius == 0.0:
        return 0.0, (0.0, 0.0, 0.0)
    if most_2 <= radius * radius * (1.0 - 1e-12):
        return tables.volumes[mesh], (0.0, 0.0, 0.0)
    count = _keep_near(tables, center, radius, near, gather_near(tables, mesh, center, radius, near))
    count, flat = _keep_touched(tables, center, radius, near, count)
    if count == 0:
        return sphere_volume(radius) if is_inside(tables, mesh, center) else 0.0, (0.0, 0.0, 0.0)
    if flat:
        # If the ball touches triangles of one plane only, these cover the ball's whole disc in this plane.
        normal = corner_of(tables, near[0], 3)
        height = dot(normal, subtract(center, corner_of(tables, near[0], 0)))
        volume, gradient, _ = cap(radius - height, radius + height, radius, normal)
        return volume, gradient
    sums = NO_SUMS
    for first in range(0, count, LANES):
        size, _ = measured(center, (0.0, 0.0, 0.0), radius, tables, near, first, count, scratch)
        sums = with_lanes(sums, size, scratch)
    volume = (sums.moment + solid_angle_inside(sums, tables, mesh, center, radius)) / 3.0
    area = radius * radius
    overlap = bounded((volume * area * radius, scale(-area, sums.push), 0.0), radius, tables.volumes[mesh])
    return overlap[0], overlap[1]


@building_block
def _keep_near(tables: MeshTables, center: Vector, radius: float, near: IntArray, count: int) -> int:
    """Keep the triangles in `near` whose planes the ball meets; return their number."""
    kept = 0
    for index in range(count):
        triangle = near[index]
        apart = dot(corner_of(tables, triangle, 3), subtract(center, corner_of(tables, triangle, 0)))
        near[kept] = triangle
        kept += 1 if abs(apart) < radius else 0
    return kept


@building_block
def _keep_touched(tables: MeshTables, center: Vector, radius: float, near: IntArray, count: int) -> tuple[int, bool]:
    """Keep the triangles in `near` that the ball touches, as long as they lie in one plane.

    From the first triangle that is touched in a second plane on, keep all triangles, touched or not. Return the number
    of kept triangles, and whether they lie in one plane.
    """
    kept = 0
    for index in range(count):
        triangle = near[index]
        if _has_corner_in(tables, triangle, center, radius) or (
            squared_distance(tables, triangle, center) < radius * radius
        ):
            near[kept] = triangle
            kept += 1
            if not _in_plane(tables, near[0], triangle, radius):
                for other in range(index + 1, count):
                    near[kept] = near[other]
                    kept += 1
                return kept, False
    return kept, True


@inlined
def _has_corner_in(tables: MeshTables, triangle: int, center: Vector, radius: float) -> bool:
    least = math.inf
    for number in range(3):
        away = subtract(corner_of(tables, triangle, number), center)
        least = min(least, dot(away, away))
    return least < radius * radius


@inlined
def _in_plane(tables: MeshTables, triangle: int, other: int, radius: float) -> bool:
    """Return whether two triangles lie in the same plane, within `_SAME_PLANE`."""
    normal = corner_of(tables, triangle, 3)
    off = subtract(normal, corner_of(tables, other, 3))
    lifted = dot(normal, subtract(corner_of(tables, triangle, 0), corner_of(tables, other, 0)))
    return dot(off, off) <= _SAME_PLANE * _SAME_PLANE and abs(lifted) <= _SAME_PLANE * radius
