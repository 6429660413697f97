"""Contact of a moving sphere with a closed mesh, convex or not.

The overlap rises only by the part of the surface that faces the motion and lies in the ball: dV/dE = -∫ n·û dA. So only
the triangles in front count, those with n·û < 0: the overlap may next rise where the sphere next touches such a
triangle. All coordinates are in the mesh's own frame; the trees are walked as in `tree_queries`.
"""

import math
from typing import NamedTuple

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract
from robot_side.overlap.meshes.mesh_tables import MeshTables
from robot_side.overlap.meshes.tree_queries import (
    corner_of,
    is_clear_of,
    is_inside,
    to_triangle,
    touches_surface,
)
from robot_side.surroundings.kinds.layout import CLOSING, ENLARGED, TOUCHING_M, way_by


class Sweep(NamedTuple):
    """Sphere that moves from `start` along the unit vector `along`, by at most `reach`."""

    start: Vector
    along: Vector
    radius: float
    reach: float
    by_axis: Vector
    """Metres along the path for each metre along an axis, for the three axes"""


@inlined
def swept(start: Vector, along: Vector, radius: float, reach: float) -> Sweep:
    """Return the sweep of a sphere, with `by_axis` computed."""
    return Sweep(start, along, radius, reach, (way_by(along[0]), way_by(along[1]), way_by(along[2])))


@building_block
def overlaps(tables: MeshTables, mesh: int, sweep: Sweep) -> bool:
    """Return whether the sphere at the start of its sweep overlaps the mesh by more than TOUCHING_M."""
    if is_clear_of(tables, mesh, sweep.start, sweep.radius):
        return False
    return touches_surface(tables, mesh, sweep.start, sweep.radius - TOUCHING_M) or is_inside(tables, mesh, sweep.start)


@inlined
def _enters(tables: MeshTables, node: int, sweep: Sweep, reach: float) -> float:
    """Return the distance at which the sphere's centre enters a node's box, enlarged by the radius, or infinity."""
    enter, leave = 0.0, reach
    grown = sweep.radius * ENLARGED + TOUCHING_M
    for axis in range(3):
        first = (tables.boxes[node, axis] - grown - sweep.start[axis]) * sweep.by_axis[axis]
        last = (tables.boxes[node, 3 + axis] + grown - sweep.start[axis]) * sweep.by_axis[axis]
        enter, leave = max(enter, min(first, last)), min(leave, max(first, last))
    return enter if enter <= leave else math.inf


@inlined
def _is_passed(tables: MeshTables, triangle: int, sweep: Sweep, reach: float) -> bool:
    """Return whether a triangle cannot be touched: the sweep misses the ball around it, or the triangle faces away."""
    normal = corner_of(tables, triangle, 3)
    if dot(normal, sweep.along) >= -CLOSING:
        return True
    offset = subtract(load(tables.spheres, triangle), sweep.start)
    part = min(max(dot(offset, sweep.along), 0.0), reach)
    apart = subtract(offset, scale(part, sweep.along))
    most: float = (tables.spheres[triangle, 3] + sweep.radius) * ENLARGED + TOUCHING_M
    return dot(apart, apart) > most * most


@building_block
def _touch(tables: MeshTables, triangle: int, sweep: Sweep, best: float) -> float:
    """Return the contact distance to a triangle in front; 0 if the sphere touches it at the start of the sweep.

    The result is `best` or more if the contact is no nearer than `best`. The triangle enlarged by the radius consists
    of a prism, three cylinders and three balls; the first contact with any of them counts.
    """
    start, along, radius = sweep.start, sweep.along, sweep.radius
    normal = corner_of(tables, triangle, 3)
    a = subtract(corner_of(tables, triangle, 0), start)
    b = subtract(corner_of(tables, triangle, 1), start)
    c = subtract(corner_of(tables, triangle, 2), start)
    height, closing = -dot(normal, a), -dot(normal, along)
    if height < -radius:
        return math.inf
    way = (height - radius) / closing
    if way >= best:
        return math.inf
    if way >= 0.0:
        foot = add(scale(way, along), scale(-radius, normal))
        inside = (
            dot(cross(subtract(a, foot), subtract(b, foot)), normal) >= 0.0
            and dot(cross(subtract(b, foot), subtract(c, foot)), normal) >= 0.0
            and dot(cross(subtract(c, foot), subtract(a, foot)), normal) >= 0.0
        )
        if inside:
            return way
    towards = to_triangle(tables, triangle, start)
    distance = norm(towards)
    if distance <= radius + TOUCHING_M:
        return 0.0 if dot(towards, along) > CLOSING * distance or distance < radius - TOUCHING_M else math.inf
    least = min(_corner_touch(a, along, radius), _corner_touch(b, along, radius), _corner_touch(c, along, radius))
    least = min(least, _edge_touch(a, b, along, radius))
    least = min(least, _edge_touch(b, c, along, radius))
    return min(least, _edge_touch(c, a, along, radius))


@inlined
def _corner_touch(corner: Vector, along: Vector, radius: float) -> float:
    """Return the contact distance to a corner, for a sphere that starts at the origin and is clear of the corner."""
    ahead, apart = dot(corner, along), dot(corner, corner) - radius * radius
    inside = ahead * ahead - apart
    if ahead <= 0.0 or inside < 0.0:
        return math.inf
    found: float = max(apart, 0.0) / (ahead + math.sqrt(inside))
    return found


@inlined
def _edge_touch(first: Vector, second: Vector, along: Vector, radius: float) -> float:
    """Return the contact distance to an edge between its ends, for a sphere as in `_corner_touch`."""
    edge = subtract(second, first)
    squared_length = dot(edge, edge)
    slant, lean = dot(edge, along), dot(edge, first)
    # Components across the edge, of the path and of the offset to the edge, times the edge's squared length.
    across = squared_length - slant * slant
    ahead = squared_length * dot(first, along) - lean * slant
    apart = squared_length * (dot(first, first) - radius * radius) - lean * lean
    inside = ahead * ahead - across * apart
    if ahead <= 0.0 or inside < 0.0:
        return math.inf
    way = max(apart, 0.0) / (ahead + math.sqrt(inside))
    place = way * slant - lean
    return way if 0.0 <= place <= squared_length else math.inf


@building_block
def next_touch(tables: MeshTables, mesh: int, sweep: Sweep, nodes: IntArray, enters: FloatArray) -> tuple[float, int]:
    """Return the contact distance to the next triangle in front, and the triangle's index.

    The distance is 0 if the sphere touches the triangle at its start, and infinite if it touches none. Boxes are
    examined in the order in which the sphere enters them. nodes, enters: scratch for waiting boxes, one for each level
    of the tree.
    """
    best, touched, node, waiting = math.inf, -1, tables.roots[mesh], 0
    reach = sweep.reach
    at = _enters(tables, node, sweep, reach)
    while True:
        if at <= reach and best > 0.0:
            first, size = tables.links[3 * node + 1], tables.links[3 * node + 2]
            if size == 0:
                near, far = node + 1, tables.links[3 * node + 3]
                at, far_at = _enters(tables, near, sweep, reach), _enters(tables, far, sweep, reach)
                if far_at < at:
                    near, far, at, far_at = far, near, far_at, at
                if far_at <= reach:
                    nodes[waiting], enters[waiting] = far, far_at
                    waiting += 1
                node = near
                continue
            for triangle in range(first, first + size):
                if not _is_passed(tables, triangle, sweep, reach):
                    found = _touch(tables, triangle, sweep, best)
                    if found < best:
                        # Nothing beyond the nearest contact so far counts.
                        best, touched, reach = found, triangle, min(reach, found)
        if waiting == 0:
            break
        waiting -= 1
        node, at = nodes[waiting], enters[waiting]
    return best if best <= sweep.reach else math.inf, touched


@building_block
def closing_at(tables: MeshTables, triangle: int, sweep: Sweep, way: float) -> float:
    """Return û·n of the plane in which the sphere touches a triangle after the distance `way`."""
    towards = to_triangle(tables, triangle, add(sweep.start, scale(way, sweep.along)))
    distance = norm(towards)
    return max(dot(towards, sweep.along) / distance, CLOSING) if distance > 0.0 else 1.0


@building_block
def crossings_of(tables: MeshTables, mesh: int, line: Sweep, crossings: FloatArray, count: int) -> int:
    """Append the crossings (n, 2) of a line with a mesh, as `crossings_of_mesh` does; return the new count."""
    node, end, room = tables.roots[mesh], tables.roots[mesh + 1], crossings.shape[0]
    while node < end:
        enter, leave = -math.inf, math.inf
        for axis in range(3):
            first = (tables.boxes[node, axis] - TOUCHING_M - line.start[axis]) * line.by_axis[axis]
            last = (tables.boxes[node, 3 + axis] + TOUCHING_M - line.start[axis]) * line.by_axis[axis]
            enter, leave = max(enter, min(first, last)), min(leave, max(first, last))
        if enter > leave:
            node = tables.links[3 * node]
            continue
        begin, size = tables.links[3 * node + 1], tables.links[3 * node + 2]
        for triangle in range(begin, begin + size):
            a = subtract(corner_of(tables, triangle, 0), line.start)
            b = subtract(corner_of(tables, triangle, 1), line.start)
            c = subtract(corner_of(tables, triangle, 2), line.start)
            # The sides of an edge in its two triangles are exactly opposite: a line passes between no two triangles.
            sides = dot(line.along, cross(a, b)), dot(line.along, cross(b, c)), dot(line.along, cross(c, a))
            leaves = sides[0] > 0.0 and sides[1] > 0.0 and sides[2] > 0.0
            enters = sides[0] < 0.0 and sides[1] < 0.0 and sides[2] < 0.0
            if (leaves or enters) and count < room:
                normal = corner_of(tables, triangle, 3)
                crossings[count, 0] = dot(normal, a) / dot(normal, line.along)
                crossings[count, 1] = 1.0 if enters else -1.0
                count += 1
        node += 1
    return count
