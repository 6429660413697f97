"""Tetrahedra. Numbers of a tetrahedron: its four vertices (12), in any order."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import FLOAT64, building_block, compiled, inlined, power_of_two_below
from robot_side.compiled.vectors import Vector, add, cross, dot, negative, norm, scale, subtract
from robot_side.overlap.solids.tetrahedron_lane import tetrahedron_lane
from robot_side.surroundings.kinds.convex_contact import convex_contact
from robot_side.surroundings.kinds.kind import Array, Kind, Placed
from robot_side.surroundings.kinds.layout import (
    ANY_DIRECTION,
    NUMBERS,
    OVERLAP,
    SHAPE_NUMBERS,
    WHOLE,
    Chord,
    Nearest,
    around,
    cut_chord,
    lengths,
    posed,
    rows,
    to_metres,
)

Vertices = tuple[Vector, Vector, Vector, Vector]


@inlined
def _corner(shapes: FloatArray, row: int, k: int, point: Vector) -> Vector:
    """Return vertex k relative to `point`."""
    return subtract((shapes[row, 3 * k], shapes[row, 3 * k + 1], shapes[row, 3 * k + 2]), point)


def place(numbers: FloatArray) -> Placed:
    """Return the tetrahedra (k) with these numbers (k, 20)."""
    corners = numbers[:, :12].reshape(-1, 4, 3)
    middles = 0.5 * (corners.min(axis=1) + corners.max(axis=1))
    radii = lengths(corners - middles[:, None]).max(axis=1)
    a, b, c = (corners[:, 1:] - corners[:, :1]).transpose(1, 2, 0)
    across = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    volumes = np.abs(across[0] * c[0] + across[1] * c[1] + across[2] * c[2]) / 6.0
    return Placed(numbers[:, :SHAPE_NUMBERS], around(middles, radii), volumes)


def placed(sizes: FloatArray, positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return the numbers of tetrahedra at these poses. sizes: the vertices in that frame."""
    return rows(posed(positions, rotations, sizes[:, :12].reshape(-1, 4, 3)), width=NUMBERS)


@inlined
def _edge_foot(start: Vector, end: Vector) -> Vector:
    """Return the point of an edge that is nearest to the origin."""
    edge = subtract(end, start)
    squared_length = dot(edge, edge)
    if squared_length == 0.0:
        return start
    along = min(max(-dot(start, edge) / squared_length, 0.0), 1.0)
    return add(start, scale(along, edge))


@inlined
def _face(a: Vector, b: Vector, c: Vector, orientation: float) -> tuple[float, Vector, bool]:
    """Return the origin's height over the face abc, its outward normal, and whether the origin's foot is inside it."""
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
    """Return signed distance and direction from `point` to the surface of the tetrahedron in `row` (see `Nearest`).

    A tetrahedron without volume is a plate: its distances are never negative.
    """
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
        # A foot that rounding puts just off its face does no harm: the edge is equally near.
        if foot_inside and height * height < squared_distance:
            foot, squared_distance = scale(-height, normal), height * height
        if height > faces[face][0]:
            face = k
    distance = math.sqrt(squared_distance)
    if distance > 0.0 and (six_volumes == 0.0 or faces[face][0] > 0.0):
        return distance, scale(1.0 / distance, foot)
    direction = negative(faces[face][1])
    # A tetrahedron without area has no normal.
    return faces[face][0], direction if dot(direction, direction) > 0.0 else ANY_DIRECTION


contact = convex_contact(nearest)


@building_block
def chord(shapes: FloatArray, row: int, start: Vector, along: Vector) -> Chord:
    """Return the chord of a line from `start` along the unit vector `along` in the tetrahedron in `row`."""
    a, b = _corner(shapes, row, 0, start), _corner(shapes, row, 1, start)
    c, d = _corner(shapes, row, 2, start), _corner(shapes, row, 3, start)
    sign = -1.0 if dot(cross(subtract(c, b), subtract(d, b)), subtract(b, a)) < 0.0 else 1.0
    found = WHOLE
    for first, second, third in ((b, c, d), (a, d, c), (a, b, d), (a, c, b)):
        normal = scale(sign, cross(subtract(second, first), subtract(third, first)))
        found = cut_chord(found, -dot(normal, first), dot(normal, along))
    return found


@compiled(*OVERLAP, returns=FLOAT64)
def overlap_one_tetrahedron(
    shapes: FloatArray,
    row: int,
    x: float,
    y: float,
    z: float,
    radius: float,
    _meshes: IntArray,
    overlap_gradient: FloatArray,
) -> float:
    """Return the overlap of a sphere with the tetrahedron in `row`."""
    size, center = power_of_two_below(radius), (x, y, z)
    part = 1.0 / size
    corners = (
        scale(part, _corner(shapes, row, 0, center)),
        scale(part, _corner(shapes, row, 1, center)),
        scale(part, _corner(shapes, row, 2, center)),
        scale(part, _corner(shapes, row, 3, center)),
    )
    found, _ = tetrahedron_lane((0.0, 0.0, 0.0), part * radius, corners)
    return to_metres(found[0], found[1], size, radius, overlap_gradient)


KIND: Final = Kind(
    "tetrahedron",
    (Array("tetrahedron_vertices_m", (4, 3)),),
    placed=placed,
    place=place,
    nearest=nearest,
    contact=contact,
    chord=chord,
    kernel=overlap_one_tetrahedron,
)
