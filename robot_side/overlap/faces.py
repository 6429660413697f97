"""Flat faces of a solid, seen from the sphere's centre: their area in the ball and the surface they cover."""

import math

from robot_side.overlap.compile import building_block, inlined
from robot_side.overlap.orthoscheme import face_areas, orthoscheme
from robot_side.overlap.vectors import Vector, add, cross, dot, negative, norm, subtract, unit

Triangle = tuple[Vector, Vector, Vector]
"""Corners relative to the sphere's centre (m), anticlockwise as seen from outside the solid."""

Plane = tuple[Vector, float, float]
"""(outward unit normal n, signed distance h of the face from the centre along n, twice the face's area)."""

FaceAreas = tuple[float, float, bool]
"""(A, S, reached): see `orthoscheme`; `reached` says whether the face has a point inside the ball."""


@inlined
def triangle_plane(corners: Triangle, edges: Triangle) -> Plane:
    """The plane of a triangle; `edges` lead from corner i to corner i + 1 (m).

    The two shortest edges give the normal and the nearest corner the distance, as these round least. A
    triangle without area gets the normal 0, and so counts for nothing.
    """
    a, b, c = corners
    ab, bc, ca = edges
    ab_2, bc_2, ca_2 = dot(ab, ab), dot(bc, bc), dot(ca, ca)
    if ab_2 >= bc_2 and ab_2 >= ca_2:
        normal = cross(bc, ca)
    elif bc_2 >= ca_2:
        normal = cross(ca, ab)
    else:
        normal = cross(ab, bc)
    a_2, b_2, c_2 = dot(a, a), dot(b, b), dot(c, c)
    if a_2 <= b_2 and a_2 <= c_2:
        nearest = a
    elif b_2 <= c_2:
        nearest = b
    else:
        nearest = c
    direction = unit(normal)
    return direction, dot(nearest, direction), norm(normal)


@building_block
def triangle_face(corners: Triangle, directions: Triangle, plane: Plane, radius: float) -> FaceAreas:
    """(A, S, reached) of the triangle `corners` in `plane`; `directions` are its edges' unit vectors."""
    a, b, c = corners
    normal, height, area_2 = plane
    depth = abs(height)
    if depth < radius:
        first = _edge_frame(a, b, directions[0], normal)
        second = _edge_frame(b, c, directions[1], normal)
        third = _edge_frame(c, a, directions[2], normal)
        nearest_2 = min(_nearest_2(height, first), _nearest_2(height, second), _nearest_2(height, third))
        foot_inside = min(first[0], second[0], third[0]) > 0.0
        if foot_inside or nearest_2 < radius * radius:
            terms = add(add(_edge(depth, first, radius), _edge(depth, second, radius)), _edge(depth, third, radius))
            disc, covered = face_areas(height, terms[0], terms[1], terms[2], radius)
            return disc, covered, True
    return 0.0, radius * radius * _solid_angle(a, b, c, height * area_2), False


@building_block
def parallelogram_face(
    middle: Vector, half_edges: tuple[Vector, Vector], directions: tuple[Vector, Vector], plane: Plane, radius: float
) -> FaceAreas:
    """(A, S, reached) of the parallelogram `middle` ± half_edges[0] ± half_edges[1] in `plane`.

    `middle` is relative to the sphere's centre (m), `directions` are the unit vectors of `half_edges`, whose
    vector product points outward.
    """
    u, v = half_edges
    normal, height, area_2 = plane
    a, b = subtract(subtract(middle, u), v), subtract(add(middle, u), v)
    c, d = add(add(middle, u), v), add(subtract(middle, u), v)
    depth = abs(height)
    if depth < radius:
        first = _edge_frame(a, b, directions[0], normal)
        second = _edge_frame(b, c, directions[1], normal)
        third = _edge_frame(c, d, negative(directions[0]), normal)
        fourth = _edge_frame(d, a, negative(directions[1]), normal)
        nearest_2 = min(
            _nearest_2(height, first),
            _nearest_2(height, second),
            _nearest_2(height, third),
            _nearest_2(height, fourth),
        )
        foot_inside = min(first[0], second[0], third[0], fourth[0]) > 0.0
        if foot_inside or nearest_2 < radius * radius:
            terms = add(
                add(_edge(depth, first, radius), _edge(depth, second, radius)),
                add(_edge(depth, third, radius), _edge(depth, fourth, radius)),
            )
            disc, covered = face_areas(height, terms[0], terms[1], terms[2], radius)
            return disc, covered, True
    volume_6 = 0.5 * height * area_2
    return 0.0, radius * radius * (_solid_angle(a, b, c, volume_6) + _solid_angle(a, c, d, volume_6)), False


@inlined
def _edge_frame(start: Vector, end: Vector, direction: Vector, normal: Vector) -> Vector:
    """(d, t_start, t_end) of the edge along the unit vector `direction` of a face with the unit `normal`."""
    return dot(start, cross(direction, normal)), dot(start, direction), dot(end, direction)


@inlined
def _nearest_2(height: float, frame: Vector) -> float:
    """The squared distance (m²) from the centre to the edge, its ends included."""
    distance, start, end = frame
    along = max(start, -end, 0.0)
    return height * height + distance * distance + along * along


@inlined
def _edge(depth: float, frame: Vector, radius: float) -> Vector:
    """The edge's terms: those of the orthoscheme of its end less those of its start."""
    distance, start, end = frame
    return subtract(orthoscheme(depth, distance, end, radius), orthoscheme(depth, distance, start, radius))


@inlined
def _solid_angle(a: Vector, b: Vector, c: Vector, volume_6: float) -> float:
    """The signed solid angle (sr) of a triangle that does not contain the centre, by one arctangent.

    `volume_6` is the triple product of the corners. The formula is van Oosterom's and Strackee's (1983).
    """
    length_a, length_b, length_c = norm(a), norm(b), norm(c)
    cosine = length_a * length_b * length_c
    cosine += dot(a, b) * length_c + dot(b, c) * length_a + dot(c, a) * length_b
    return 2.0 * math.atan2(volume_6, cosine)
