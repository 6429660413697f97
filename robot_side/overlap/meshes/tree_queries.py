"""Queries of a mesh's tree: triangles that a ball may reach, nearest triangle, inside or outside, winding number."""

import math

import numpy as np

from common.arrays import IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract
from robot_side.overlap.meshes.mesh_tables import MeshTables

_CERTAIN = 0.2
"""Largest distance of a computed winding number from a whole number to which it may be rounded"""


@inlined
def _box_distance_2(tables: MeshTables, node: int, point: Vector) -> float:
    """Return the squared distance (m²) from `point` to the box of a node."""
    total = 0.0
    row = np.uint64(node)
    for axis in range(3):
        low, high = tables.boxes[row, axis], tables.boxes[row, 3 + axis]
        gap = max(low - point[axis], point[axis] - high, 0.0)
        total += gap * gap
    return total


@inlined
def is_clear_of(tables: MeshTables, mesh: int, point: Vector, radius: float) -> bool:
    """Return whether the ball (`point`, `radius`) lies outside a mesh's box, with a margin for `point`'s rounding."""
    apart_2 = _box_distance_2(tables, tables.roots[mesh], point)
    return apart_2 > 1.000001 * radius * radius + 1e-24 * dot(point, point)


@building_block
def gather_near(tables: MeshTables, mesh: int, point: Vector, radius: float, near: IntArray) -> int:
    """Write the numbers of the triangles that the ball (`point`, `radius`) may reach into `near`; return their count.

    Some of them may be out of reach, but no triangle within reach is missing. `near` has room for all triangles of the
    mesh and one more.
    """
    count = 0
    node, end = tables.roots[mesh], tables.roots[mesh + 1]
    while node < end:
        if _box_distance_2(tables, node, point) > radius * radius:
            node = tables.links[3 * node]
            continue
        first, size = tables.links[3 * node + 1], tables.links[3 * node + 2]
        for triangle in range(first, first + size):
            row = np.uint64(triangle)
            gap_x = tables.spheres[row, 0] - point[0]
            gap_y = tables.spheres[row, 1] - point[1]
            gap_z = tables.spheres[row, 2] - point[2]
            reach = tables.spheres[row, 3] + radius
            # Always written, but counted only if near: so there is no branch to predict.
            near[count] = triangle
            count += 1 if gap_x * gap_x + gap_y * gap_y + gap_z * gap_z <= reach * reach else 0
        node += 1
    return count


@inlined
def corner_of(tables: MeshTables, triangle: int, number: int) -> Vector:
    """Return the corner 0, 1 or 2 of a triangle (m); for `number` = 3 its outward unit normal."""
    return (
        tables.triangles[triangle, 3 * number],
        tables.triangles[triangle, 3 * number + 1],
        tables.triangles[triangle, 3 * number + 2],
    )


@building_block
def to_triangle(tables: MeshTables, triangle: int, point: Vector) -> Vector:
    """Return the vector (m) from `point` to the nearest point of a triangle."""
    normal = corner_of(tables, triangle, 3)
    best, best_2 = (0.0, 0.0, 0.0), math.inf
    inside = True
    for number in range(3):
        start = subtract(corner_of(tables, triangle, number), point)
        end = subtract(corner_of(tables, triangle, (number + 1) % 3), point)
        edge = subtract(end, start)
        along = min(max(-dot(start, edge) * tables.triangles[triangle, 12 + number] ** 2, 0.0), 1.0)
        foot = add(start, scale(along, edge)) if along < 0.5 else subtract(end, scale(1.0 - along, edge))
        distance_2 = dot(foot, foot)
        if distance_2 < best_2:
            best, best_2 = foot, distance_2
        inside = inside and dot(start, cross(edge, normal)) >= 0.0
    if inside:
        # Any point of the plane gives the distance; `best`, the nearest point of the edges, rounds least.
        return scale(dot(best, normal), normal)
    return best


@building_block
def squared_distance(tables: MeshTables, triangle: int, point: Vector) -> float:
    """Return the squared distance (m²) from `point` to a triangle."""
    foot = to_triangle(tables, triangle, point)
    return dot(foot, foot)


@building_block
def touches_surface(tables: MeshTables, mesh: int, point: Vector, radius: float) -> bool:
    """Return whether any triangle of the mesh is nearer to `point` than `radius`."""
    node, end = tables.roots[mesh], tables.roots[mesh + 1]
    while node < end:
        if radius <= 0.0 or _box_distance_2(tables, node, point) > radius * radius:
            node = tables.links[3 * node]
            continue
        first, size = tables.links[3 * node + 1], tables.links[3 * node + 2]
        for triangle in range(first, first + size):
            gap = subtract(load(tables.spheres, triangle), point)
            reach = tables.spheres[triangle, 3] + radius
            if dot(gap, gap) <= reach * reach and squared_distance(tables, triangle, point) < radius * radius:
                return True
        node += 1
    return False


@building_block
def nearest_triangle(tables: MeshTables, mesh: int, point: Vector) -> tuple[int, Vector]:
    """Return (the number of the triangle nearest to `point`, the vector in m from `point` to its nearest point)."""
    first, end = tables.roots[mesh], tables.roots[mesh + 1]
    # Descend to the nearer child for a good first bound.
    node = first
    while tables.links[3 * node + 2] == 0:
        second = tables.links[3 * (node + 1)]
        nearer = _box_distance_2(tables, node + 1, point) <= _box_distance_2(tables, second, point)
        node = node + 1 if nearer else second
    best = tables.links[3 * node + 1]
    foot = to_triangle(tables, best, point)
    bound = dot(foot, foot)
    node = first
    while node < end:
        if _box_distance_2(tables, node, point) > bound:
            node = tables.links[3 * node]
            continue
        start, size = tables.links[3 * node + 1], tables.links[3 * node + 2]
        for triangle in range(start, start + size):
            gap = subtract(load(tables.spheres, triangle), point)
            reach = tables.spheres[triangle, 3] + math.sqrt(bound)
            if dot(gap, gap) <= reach * reach:
                other = to_triangle(tables, triangle, point)
                if dot(other, other) < bound:
                    best, foot, bound = triangle, other, dot(other, other)
        node += 1
    return best, foot


@inlined
def _crosses(start: Vector, end: Vector, point: Vector, u: int, v: int) -> bool:
    """Return whether the ray from `point` along the axis `u` crosses an edge, both projected to the u-v plane.

    An edge and its reverse give the same answer.
    """
    if (start[v] > point[v]) == (end[v] > point[v]):
        return False
    low, high = (start, end) if start[v] < end[v] else (end, start)
    side: float = (high[u] - low[u]) * (point[v] - low[v]) - (point[u] - low[u]) * (high[v] - low[v])
    return side > 0.0


@building_block
def is_inside(tables: MeshTables, mesh: int, point: Vector) -> bool:
    """Return whether a point that is not on the surface lies inside a mesh.

    It counts how often a ray from the point, along an axis to the nearest side of the mesh's box, crosses the surface.
    From inside the number is odd.
    """
    node, end = tables.roots[mesh], tables.roots[mesh + 1]
    axis, sign, least = 0, 1.0, math.inf
    for number in range(3):
        below, above = point[number] - tables.boxes[node, number], tables.boxes[node, 3 + number] - point[number]
        if min(below, above) < 0.0:
            return False
        if min(below, above) < least:
            axis, sign, least = number, 1.0 if above < below else -1.0, min(below, above)
    u, v, inside, level = (axis + 1) % 3, (axis + 2) % 3, False, sign * point[axis]
    while node < end:
        box = tables.boxes[node]
        ahead = sign * (box[3 + axis] if sign > 0.0 else box[axis]) >= level
        if not (ahead and box[u] <= point[u] <= box[3 + u] and box[v] <= point[v] <= box[3 + v]):
            node = tables.links[3 * node]
            continue
        first, size = tables.links[3 * node + 1], tables.links[3 * node + 2]
        for triangle in range(first, first + size):
            a, b, c = corner_of(tables, triangle, 0), corner_of(tables, triangle, 1), corner_of(tables, triangle, 2)
            odd = _crosses(a, b, point, u, v) != _crosses(b, c, point, u, v)
            if odd != _crosses(c, a, point, u, v):
                low, high = sign * min(a[axis], b[axis], c[axis]), sign * max(a[axis], b[axis], c[axis])
                normal = corner_of(tables, triangle, 3)
                behind = dot(normal, subtract(point, a)) * sign * normal[axis] < 0.0
                if min(low, high) > level or (max(low, high) >= level and behind):
                    inside = not inside
        node += 1
    return inside


@inlined
def _solid_angle(tables: MeshTables, triangle: int, point: Vector) -> float:
    """Return the signed solid angle (sr) of a triangle seen from `point`, by van Oosterom and Strackee (1983)."""
    a = subtract(corner_of(tables, triangle, 0), point)
    b = subtract(corner_of(tables, triangle, 1), point)
    c = subtract(corner_of(tables, triangle, 2), point)
    length_a, length_b, length_c = norm(a), norm(b), norm(c)
    cosine = length_a * length_b * length_c
    cosine += dot(a, b) * length_c + dot(b, c) * length_a + dot(c, a) * length_b
    sine = dot(a, cross(b, c))
    return 2.0 * math.atan2(sine, cosine) if sine != 0.0 else 0.0


@building_block
def winding_number(tables: MeshTables, mesh: int, point: Vector) -> int:
    """Return the winding number of the mesh's surface about `point`, which is not on it: 1 inside, 0 outside.

    Groups of triangles far from the point are approximated by dipoles (Barill and others, Fast Winding Numbers, 2018).
    The exact sum is a whole number. If the sum is not close to one, it is recomputed with fewer dipoles, at last with
    none.
    """
    total = 0.0
    for share in (2.0, 4.0, math.inf):
        total = 0.0
        node, end = tables.roots[mesh], tables.roots[mesh + 1]
        while node < end:
            away = subtract(load(tables.moments, node), point)
            distance_2 = dot(away, away)
            limit = share * tables.moments[node, 6]
            if distance_2 > limit * limit:
                area = tables.moments[node, 3], tables.moments[node, 4], tables.moments[node, 5]
                total += dot(area, away) / (distance_2 * math.sqrt(distance_2))
                node = tables.links[3 * node]
                continue
            first, size = tables.links[3 * node + 1], tables.links[3 * node + 2]
            for triangle in range(first, first + size):
                total += _solid_angle(tables, triangle, point)
            node += 1
        total /= 4.0 * math.pi
        if abs(total - math.floor(total + 0.5)) < _CERTAIN:
            break
    return math.floor(total + 0.5)
