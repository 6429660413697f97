"""Overlap of a sphere and a closed mesh (eq. 11); `triangle_lanes` explains the method."""

import math
from typing import NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, dot, scale
from robot_side.overlap.digits.double_double import ZERO, divided, plus
from robot_side.overlap.digits.double_double_vectors import PreciseVector, highs, precise_add, precise_scale
from robot_side.overlap.meshes.large_triangles import FAR, corners_about, is_far, refine_lane
from robot_side.overlap.meshes.mesh_tables import FIELDS, MeshTables
from robot_side.overlap.meshes.small_mesh_overlap import beyond_face
from robot_side.overlap.meshes.tree_queries import (
    gather_near,
    nearest_triangle,
    squared_distance,
    winding_number,
)
from robot_side.overlap.meshes.triangle_lanes import (
    CORNERS,
    IMAGINARY,
    LANES,
    LONGEST,
    MOMENT,
    PUSH,
    PUSH_Y,
    PUSH_Z,
    REAL,
    ROW,
    TURN,
    WIDTH,
    Complex,
    reduce_lanes,
    times,
    triangle_geometry,
    triangle_terms,
)
from robot_side.overlap.solids.solid import (
    Overlap,
    bounded,
    nothing,
    whole_solid,
    whole_sphere,
)

_WHOLE = 4.0 * math.pi
_UNDECIDED_AREA = 1e-11
"""Distance of a solid angle from 0 or 4π, in sr, up to which rounding may have turned one into the other"""
_UNDECIDED_VOLUME = 1e-8
"""Volume (for radius 1) computed with a solid angle near 0, up to which the solid angle may in truth be 4π. A volume
below the negative of this value shows that it is 4π."""
_SMALL_VOLUME = 1e-5
"""Overlap (for radius 1) below which it is recomputed with less cancellation"""
_CLOSE = 0.02
"""Distance of the sphere's centre from the surface, in radii. A centre farther away lies outside the mesh if the
overlap is small."""


class Sums(NamedTuple):
    """Product of the triangles' complex numbers, and sums of their `TURN`, `MOMENT` and `PUSH` (`triangle_lanes`)."""

    product: Complex
    turn: float
    moment: float
    push: Vector


NO_SUMS = Sums((1.0, 0.0), 0.0, 0.0, (0.0, 0.0, 0.0))


@building_block
def mesh_overlap(
    precise_center: PreciseVector,
    radius: float,
    tables: MeshTables,
    mesh: int,
    near: IntArray,
    scratch: FloatArray,
) -> tuple[Overlap, int]:
    """Return (the overlap of the sphere with the mesh, the number of triangles evaluated).

    `precise_center` (m) is in the mesh's frame; `mesh` is the mesh's number in `tables`. `near` has room for one
    triangle more than the mesh has, `scratch` for `triangle_lanes.SCRATCH` numbers.
    """
    center = highs(precise_center)
    least_2, most_2 = box_distances_2(tables, mesh, center)
    if least_2 >= radius * radius or radius == 0.0:
        return nothing(), 0
    if most_2 <= radius * radius * (1.0 - 1e-12):
        return whole_solid(tables.volumes[mesh]), 0
    count = gather_near(tables, mesh, center, radius, near)
    if count == 0:
        if winding_number(tables, mesh, center) > 0:
            return whole_sphere(radius), 0
        return nothing(), 0
    sums = NO_SUMS
    for first in range(0, count, LANES):
        size, large = measured(center, _lows(precise_center), radius, tables, near, first, count, scratch)
        if large:
            for lane in range(size):
                triangle = near[first + lane]
                if tables.triangles[triangle, 15] > FAR * radius and is_far(scratch, lane):
                    refine_lane(scratch, lane, tables, triangle, precise_center, radius)
        sums = with_lanes(sums, size, scratch)
    push = sums.push
    covered = solid_angle_inside(sums, tables, mesh, center, radius)
    moment = sums.moment
    volume = (moment + covered) / 3.0
    if volume < _SMALL_VOLUME:
        applies, small, small_covered, small_push = _small_overlap(precise_center, radius, tables, near, count)
        if applies:
            volume, covered, push = small, small_covered, small_push
    # Up to here lengths are in radii.
    area = radius * radius
    overlap = volume * area * radius, scale(-area, push), covered * area
    return bounded(overlap, radius, tables.volumes[mesh]), count


@inlined
def box_distances_2(tables: MeshTables, mesh: int, point: Vector) -> tuple[float, float]:
    """Return the squared distances (m²) from `point` to the nearest and the farthest point of a mesh's box."""
    least, most = 0.0, 0.0
    root = tables.roots[mesh]
    for axis in range(3):
        below, above = tables.boxes[root, axis] - point[axis], point[axis] - tables.boxes[root, 3 + axis]
        gap, reach = max(below, above, 0.0), max(-below, -above)
        least += gap * gap
        most += reach * reach
    return least, most


@inlined
def measured(
    center: Vector,
    center_rest: Vector,
    radius: float,
    tables: MeshTables,
    near: IntArray,
    first: int,
    count: int,
    scratch: FloatArray,
) -> tuple[int, bool]:
    """Fill the scratch's lanes with the geometry of the triangles in `near` from `first` on.

    Return how many triangles fitted, and whether any is much larger than the ball.
    """
    size = min(count - first, LANES)
    groups = (size + (WIDTH - 1)) // WIDTH
    _load_lanes(tables, near, first, size, groups, scratch)
    large = 0
    for lane in range(groups * WIDTH):
        large += 1 if scratch[LONGEST + lane] > FAR * radius else 0
    triangle_geometry(scratch, groups, center, center_rest, radius)
    return size, large > 0


@inlined
def with_lanes(sums: Sums, size: int, scratch: FloatArray) -> Sums:
    """Return the sums with the terms of the scratch's first `size` triangles added."""
    triangle_terms(scratch, (size + (WIDTH - 1)) // WIDTH)
    reduce_lanes(scratch, size)
    product = times(sums.product, (scratch[REAL], scratch[IMAGINARY]))
    rescale = 1.0 / (abs(product[0]) + abs(product[1]))
    return Sums(
        (product[0] * rescale, product[1] * rescale),
        sums.turn + scratch[TURN],
        sums.moment + scratch[MOMENT],
        add(sums.push, (scratch[PUSH], scratch[PUSH_Y], scratch[PUSH_Z])),
    )


@inlined
def solid_angle_inside(sums: Sums, tables: MeshTables, mesh: int, center: Vector, radius: float) -> float:
    """Return the solid angle (sr) of the sphere's surface that lies inside the mesh."""
    covered = -2.0 * (math.atan2(sums.product[1], sums.product[0]) + sums.turn)
    covered -= _WHOLE * math.floor(covered / _WHOLE)
    if covered < _UNDECIDED_AREA or covered > _WHOLE - _UNDECIDED_AREA:
        covered -= _WHOLE if covered > 0.5 * _WHOLE else 0.0
        part = (sums.moment + covered) / 3.0
        if part < -_UNDECIDED_VOLUME or (part < _UNDECIDED_VOLUME and _mostly_inside(tables, mesh, center, radius)):
            covered += _WHOLE
    return covered


@building_block
def _small_overlap(
    center: PreciseVector, radius: float, tables: MeshTables, near: IntArray, count: int
) -> tuple[bool, float, float, Vector]:
    """Recompute a small overlap in double-double from the `count` triangles in `near`.

    Return (whether this form applies, volume, solid angle inside, Σ A n), for radius 1. It does not apply if the centre
    is close to the surface.
    """
    volume, covered, push = ZERO, ZERO, (ZERO, ZERO, ZERO)
    to_radii = divided((1.0, 0.0), (radius, 0.0))
    for index in range(count):
        triangle = near[index]
        apart_2 = squared_distance(tables, triangle, highs(center)) / (radius * radius)
        if apart_2 < _CLOSE * _CLOSE:
            return False, 0.0, 0.0, (0.0, 0.0, 0.0)
        if apart_2 < 1.000001:
            corners = corners_about(tables, triangle, center)
            scaled = (
                precise_scale(to_radii, corners[0]),
                precise_scale(to_radii, corners[1]),
                precise_scale(to_radii, corners[2]),
            )
            part, angle, area = beyond_face(scaled)
            volume, covered, push = plus(volume, part), plus(covered, angle), precise_add(push, area)
    return True, volume[0], covered[0], highs(push)


@inlined
def _lows(vector: PreciseVector) -> Vector:
    return vector[0][1], vector[1][1], vector[2][1]


@inlined
def _load_lanes(tables: MeshTables, near: IntArray, first: int, size: int, groups: int, scratch: FloatArray) -> None:
    triangles, last = tables.triangles.reshape(-1), first + size - 1
    # Loops take whole groups, so that they have no remainder; copies of the last triangle fill the last group.
    for lane in range(groups * WIDTH):
        row = FIELDS * near[min(first + lane, last)]
        for field in range(FIELDS):
            scratch[np.uint64(CORNERS + field * ROW + lane)] = triangles[np.uint64(row + field)]


@building_block
def _mostly_inside(tables: MeshTables, mesh: int, center: Vector, radius: float) -> bool:
    """Return whether the ball lies inside the mesh or outside, apart from a tiny part of it.

    The centre itself may be in this part, for example in a needle or a narrow slit. So eight points in the ball are
    tried, and the one farthest from the surface decides.
    """
    best, best_2 = center, -1.0
    for number in range(8):
        turn, level = 2.4 * number, (number - 3.5) / 4.5
        flat = math.sqrt(1.0 - level * level)
        point = add(center, scale(0.6 * radius, (flat * math.cos(turn), flat * math.sin(turn), level)))
        foot = nearest_triangle(tables, mesh, point)[1]
        distance_2 = dot(foot, foot)
        if distance_2 > best_2:
            best, best_2 = point, distance_2
        if best_2 > 0.01 * radius * radius:
            break
    return winding_number(tables, mesh, best) > 0
