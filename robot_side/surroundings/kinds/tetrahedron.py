"""Tetrahedra, vertices in any order: four vertices (12)."""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import NUMBER, building_block, compiled, inlined, power_of_two_below
from robot_side.compiled.vectors import Vector, add, cross, dot, load, negative, norm, scale, subtract
from robot_side.overlap.lanes.tetrahedron_lane import tetrahedron_lane
from robot_side.surroundings.kinds.convex_contact import convex_contact
from robot_side.surroundings.kinds.kind import Array, Kind
from robot_side.surroundings.kinds.layout import (
    ANY_DIRECTION,
    OVERLAP,
    Nearest,
    take_over,
)

Vertices = tuple[Vector, Vector, Vector, Vector]


@inlined
def place(columns: tuple[FloatArray], k: int, shape: FloatArray, bound: FloatArray) -> float:
    """Write one tetrahedron's numbers and bounds; its volume in m³."""
    vertices = columns[0]
    for corner in range(4):
        for axis in range(3):
            shape[3 * corner + axis] = vertices[k, corner, axis]
    for axis in range(3):
        low, high = vertices[k, :, axis].min(), vertices[k, :, axis].max()
        bound[axis] = 0.5 * (low + high)
    middle: Vector = (bound[0], bound[1], bound[2])
    bound[3] = 0.0
    for corner in range(4):
        bound[3] = max(bound[3], norm(subtract(load(vertices[k], corner), middle)))
    first = load(vertices[k], 0)
    a, b, c = (
        subtract(load(vertices[k], 1), first),
        subtract(load(vertices[k], 2), first),
        subtract(load(vertices[k], 3), first),
    )
    return abs(dot(cross(a, b), c)) / 6.0


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


contact = convex_contact(nearest)


@compiled(*OVERLAP, returns=NUMBER)
def overlap_one_tetrahedron(
    shapes: FloatArray,
    row: int,
    x: float,
    y: float,
    z: float,
    radius: float,
    _meshes: IntArray,
    push: FloatArray,
) -> float:
    """The overlap with a tetrahedron."""
    size, center = power_of_two_below(radius), (x, y, z)
    part = 1.0 / size
    corners = (
        scale(part, _corner(shapes, row, 0, center)),
        scale(part, _corner(shapes, row, 1, center)),
        scale(part, _corner(shapes, row, 2, center)),
        scale(part, _corner(shapes, row, 3, center)),
    )
    found, _ = tetrahedron_lane((0.0, 0.0, 0.0), part * radius, corners)
    return take_over(found[0], found[1], size, radius, push)


def _placed(positions: FloatArray, rotations: FloatArray, corners: FloatArray) -> tuple[Any, ...]:
    return (positions[:, None, :] + np.einsum("tij,tvj->tvi", rotations, corners),)


KIND: Final = Kind(
    "tetrahedron",
    (Array("tetrahedron_vertices_m", (4, 3)),),
    placed=_placed,
    place=place,
    nearest=nearest,
    contact=contact,
    kernel=overlap_one_tetrahedron,
    centers=lambda vertices: vertices.mean(axis=1),
)
