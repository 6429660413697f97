"""Which features of a solid the ball can reach, in float64 with a margin: a cheap way to the simple cases."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.overlap.compile import building_block, inlined
from robot_side.overlap.double_double_vectors import highs, load_vector
from robot_side.overlap.polyhedron_features import (
    CORNER_EDGES,
    CORNER_FACES,
    CORNERS,
    EDGE_ENDS,
    EDGE_FACES,
    EDGES,
    FACE_CORNERS,
    FACES,
    POINTS,
    SIDES,
)
from robot_side.overlap.vectors import Vector, add, cross, dot, norm, scale

NOTHING, WHOLE_SPHERE, FACE, EDGE, CORNER, ANYTHING = 0, 1, 2, 3, 4, 5
"""What `screened` can say."""
_MARGIN = 1e-14


@building_block
def screened(features: FloatArray, solid: np.int64, radius: float) -> tuple[int, int]:
    """(what the ball reaches, the number of that feature) from the corners in `features` and `radius` (m).

    - NOTHING or WHOLE_SPHERE: no point of the surface lies inside the ball, which is outside or inside the solid;
    - FACE: no edge has a point inside the ball, and one face at most;
    - EDGE: no corner lies in the ball, and no other edge and no face but its own two has a point there;
    - CORNER: no other corner and only edges and faces that meet in this one have a point inside the ball;
    - ANYTHING: what rounding may decide, and everything else.
    """
    edges, corners, farthest = EDGES[solid], CORNERS[solid], 0.0
    for corner in range(corners):
        farthest = max(farthest, norm(_point(features, corner)))
    margin = _MARGIN * farthest
    inside_corners, corner = 0, 0
    for candidate in range(corners):
        if norm(_point(features, candidate)) < radius + margin:
            inside_corners += 1
            corner = candidate
    reached_edges, edge = 0, 0
    for candidate in range(edges):
        if _edge_distance(features, solid, candidate) < radius + margin:
            reached_edges += 1
            edge = candidate
    if inside_corners > 1 or reached_edges > 3:
        return ANYTHING, 0

    reached_faces, face, foreign_faces, all_above = 0, 0, 0, True
    certain = True
    for candidate in range(FACES[solid]):
        height, inside, face_margin = _face(features, solid, candidate, margin)
        certain = certain and face_margin < 0.25 * radius
        all_above = all_above and height > radius - face_margin
        if abs(height) > radius + face_margin or inside < -face_margin:
            continue
        reached_faces += 1
        face = candidate
        certain = certain and inside > face_margin
        if inside_corners == 1:
            foreign_faces += 0 if _is_one_of(candidate, CORNER_FACES[solid, corner]) else 1
        elif not _is_one_of(candidate, EDGE_FACES[solid, edge]):
            foreign_faces += 1
    what, feature = ANYTHING, 0
    if reached_edges == 0:
        if certain and reached_faces == 0:
            what = WHOLE_SPHERE if all_above else NOTHING
        elif certain and reached_faces == 1:
            what, feature = FACE, face
    elif inside_corners == 0 and reached_edges == 1 and foreign_faces == 0:
        what, feature = EDGE, edge
    elif inside_corners == 1 and foreign_faces == 0:
        own_edges = 0
        for own in CORNER_EDGES[solid, corner]:
            own_edges += 1 if _edge_distance(features, solid, own) < radius + margin else 0
        if own_edges == reached_edges:
            what, feature = CORNER, corner
    return what, feature


@inlined
def _point(features: FloatArray, corner: int) -> Vector:
    return highs(load_vector(features, POINTS + corner))


@building_block
def _side(features: FloatArray, start: int, end: int) -> Vector:
    """The vector from one corner to another, to full relative accuracy."""
    a, b = load_vector(features, POINTS + start), load_vector(features, POINTS + end)
    return (
        (b[0][0] - a[0][0]) + (b[0][1] - a[0][1]),
        (b[1][0] - a[1][0]) + (b[1][1] - a[1][1]),
        (b[2][0] - a[2][0]) + (b[2][1] - a[2][1]),
    )


@building_block
def _edge_distance(features: FloatArray, solid: np.int64, edge: int) -> float:
    """The distance (m) from the centre to the edge, its ends included."""
    start_corner, end_corner = EDGE_ENDS[solid, edge]
    start, end = _point(features, start_corner), _point(features, end_corner)
    side = _side(features, start_corner, end_corner)
    length_2 = dot(side, side)
    start_2, end_2 = dot(start, start), dot(end, end)
    nearer, sign = (start, 1.0) if start_2 <= end_2 else (end, -1.0)
    share = -sign * dot(nearer, side) / length_2
    if not 0.0 < share < 1.0:
        return math.sqrt(min(start_2, end_2))
    return norm(add(nearer, scale(sign * share, side)))


@building_block
def _face(features: FloatArray, solid: np.int64, face: int, margin: float) -> tuple[float, float, float]:
    """(signed height h, least signed distance d of a side, how far rounding may put them off), all in m."""
    corners = FACE_CORNERS[solid, face]
    first, second = _side(features, corners[0], corners[1]), _side(features, corners[1], corners[2])
    across = cross(first, second)
    area_2 = norm(across)
    if area_2 == 0.0:
        return 0.0, 0.0, math.inf
    normal = scale(1.0 / area_2, across)
    face_margin = margin * (1.0 + norm(first) * norm(second) / area_2)
    height = dot(_point(features, corners[1]), normal)
    inside, sides = math.inf, SIDES[solid]
    for side in range(sides):
        end = corners[side + 1] if side + 1 < sides else corners[0]
        along = _side(features, corners[side], end)
        start = _point(features, corners[side])
        inside = min(inside, dot(start, cross(along, normal)) / norm(along))
    return height, inside, face_margin


@inlined
def _is_one_of(number: int, numbers: IntArray) -> bool:
    found = False
    for other in numbers:
        found = found or other == number
    return found
