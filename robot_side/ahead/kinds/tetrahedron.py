"""Tetrahedra, vertices in any order: four vertices (12)."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.kinds.layout import ANY_DIRECTION, CLOSING, LEAST_WAY_M, MOST_STEPS, TOUCHING_M, Nearest
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, cross, dot, negative, norm, scale, subtract
from robot_side.objects.perceived import PerceivedObjects

Vertices = tuple[Vector, Vector, Vector, Vector]


def volumes(objects: PerceivedObjects) -> FloatArray:
    """Volumes (t,) in m³."""
    vertices = objects.tetrahedron_vertices_m
    edges = vertices[:, 1:] - vertices[:, :1]
    found: FloatArray = np.abs(np.einsum("ti,ti->t", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2])) / 6.0
    return found


@inlined
def _corner(shapes: FloatArray, row: int, k: int, point: Vector) -> Vector:
    """Vertex k, seen from `point`."""
    return subtract((shapes[row, 3 * k], shapes[row, 3 * k + 1], shapes[row, 3 * k + 2]), point)


@inlined
def _edge_foot(start: Vector, end: Vector) -> Vector:
    """The point of an edge that is nearest to the origin."""
    edge = subtract(end, start)
    squared_length = dot(edge, edge)
    if squared_length == 0.0:
        return start
    along = min(max(-dot(start, edge) / squared_length, 0.0), 1.0)
    return add(start, scale(along, edge))


@inlined
def _face(a: Vector, b: Vector, c: Vector, orientation: float) -> tuple[float, Vector, bool]:
    """The origin's height over the face abc, the face's outward normal, and whether the origin's foot lies within."""
    raw = cross(subtract(b, a), subtract(c, a))
    area = norm(raw)
    if area == 0.0:
        return 0.0, (0.0, 0.0, 0.0), False
    normal = scale(orientation / area, raw)
    # The foot lies on the inner side of the edge from u to v where raw · (u x v) >= 0.
    foot_inside = dot(raw, cross(a, b)) >= 0.0 and dot(raw, cross(b, c)) >= 0.0 and dot(raw, cross(c, a)) >= 0.0
    return -dot(normal, a), normal, foot_inside


@building_block
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """The nearest point of the surface of the tetrahedron in `row`; one of zero volume is a plate without an inside."""
    a, b = _corner(shapes, row, 0, point), _corner(shapes, row, 1, point)
    c, d = _corner(shapes, row, 2, point), _corner(shapes, row, 3, point)
    vertices = a, b, c, d
    six_volumes = dot(cross(subtract(c, b), subtract(d, b)), subtract(b, a))
    orientation = -1.0 if six_volumes < 0.0 else 1.0
    # In this order the faces' normals point outward where the vertices are positively oriented.
    faces = (
        _face(b, c, d, orientation),
        _face(a, d, c, orientation),
        _face(a, b, d, orientation),
        _face(a, c, b, orientation),
    )
    foot = 0.0, 0.0, 0.0
    squared_distance = math.inf
    for start in range(3):
        for end in range(start + 1, 4):
            on_edge = _edge_foot(vertices[start], vertices[end])
            if dot(on_edge, on_edge) < squared_distance:
                foot, squared_distance = on_edge, dot(on_edge, on_edge)
    face = 0
    for k in range(4):
        height, normal, foot_inside = faces[k]
        # A foot that rounding puts just off its face does no harm: the edge there is as near.
        if foot_inside and height * height < squared_distance:
            foot, squared_distance = scale(-height, normal), height * height
        if height > faces[face][0]:
            face = k
    distance = math.sqrt(squared_distance)
    if distance > 0.0 and (six_volumes == 0.0 or faces[face][0] > 0.0):
        return distance, scale(1.0 / distance, foot)
    direction = negative(faces[face][1])
    # On a tetrahedron without any area there is no face to take the normal of.
    return faces[face][0], direction if dot(direction, direction) > 0.0 else ANY_DIRECTION


@building_block
def way(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float) -> float:
    """The way at which a sphere that moves along the unit vector `along` first touches it; inf beyond the reach.

    Each step ends at the plane that touches the tetrahedron at its nearest point.
    """
    moved, point = 0.0, start
    for _ in range(MOST_STEPS):
        distance, towards = nearest(shapes, row, point)
        gap = distance - radius
        if gap < -TOUCHING_M:
            return moved
        closing = dot(towards, along)
        if closing <= CLOSING:
            return math.inf
        if gap <= TOUCHING_M:
            return max(moved, LEAST_WAY_M)
        step = gap / closing
        moved += step
        if moved > reach:
            return math.inf
        point = add(point, scale(step, along))
    # What still moves grazes: so far it has not touched.
    return moved
