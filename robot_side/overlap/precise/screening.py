"""Screening of a solid's features in float64, with a margin: it finds the simple cases, in which the ball reaches one.

Features are corners, edges and faces.
"""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, cross, dot
from robot_side.overlap.digits.double_double_vectors import highs, load_vector
from robot_side.overlap.precise.features import (
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

NOTHING, WHOLE_SPHERE, FACE, EDGE, CORNER, ANYTHING = 0, 1, 2, 3, 4, 5
"""Results of `screened`: what the ball reaches"""
_APART, _PIERCED, _UNCERTAIN = 0, 1, 2
"""States of a face whose sides the ball does not reach: the ball does not reach the face; the ball cuts a disc from the
face's inside; rounding may decide"""
_MARGIN = 1e-14


@building_block
def screened(features: FloatArray, solid: np.int64, radius: float) -> tuple[int, int]:
    """Return (the kind of feature that the ball reaches, its number) from the corners in `features` and `radius` (m).

    - NOTHING: no point of the surface lies inside the ball, and the ball is outside the solid;
    - WHOLE_SPHERE: no point of the surface lies inside the ball, and the ball is inside the solid;
    - FACE: exactly one face has points inside the ball, and no edge has;
    - EDGE: exactly one edge has points inside the ball; no corner lies inside it, and no face but the edge's own two
      has points there;
    - CORNER: exactly one corner lies inside the ball, and only edges and faces that meet in it have points there;
    - ANYTHING: all other cases, and those that rounding may decide.
    """
    farthest_2 = 0.0
    for candidate in range(CORNERS[solid]):
        point = _point(features, candidate)
        farthest_2 = max(farthest_2, dot(point, point))
    within_2 = radius * radius + _MARGIN * farthest_2
    inside_corners, corner = 0, 0
    for candidate in range(CORNERS[solid]):
        point = _point(features, candidate)
        if dot(point, point) < within_2:
            inside_corners += 1
            corner = candidate
    reached_edges, edge, foreign_edges = 0, 0, 0
    for candidate in range(EDGES[solid]):
        if _is_near(features, solid, candidate, within_2):
            reached_edges += 1
            edge = candidate
            foreign_edges += 0 if _is_one_of(candidate, CORNER_EDGES[solid, corner], 3) else 1
    if reached_edges == 0:
        return _screened_faces(features, solid, radius, math.sqrt(farthest_2))
    what, feature, count, own = ANYTHING, 0, 0, CORNER_FACES[solid, corner]
    if inside_corners == 0 and reached_edges == 1:
        what, feature, count, own = EDGE, edge, 2, EDGE_FACES[solid, edge]
    elif inside_corners == 1 and foreign_edges == 0:
        what, feature, count = CORNER, corner, 3
    for face in range(FACES[solid]):
        if what != ANYTHING and not _is_one_of(face, own, count):
            state, _ = _pierced(features, solid, face, radius, math.sqrt(farthest_2))
            what = what if state == _APART else ANYTHING
    return what, feature


@building_block
def _screened_faces(features: FloatArray, solid: np.int64, radius: float, farthest: float) -> tuple[int, int]:
    """Return what `screened` returns, if the ball reaches no edge."""
    pierced, pierced_face, all_above = 0, 0, True
    for face in range(FACES[solid]):
        state, above = _pierced(features, solid, face, radius, farthest)
        if state == _UNCERTAIN:
            return ANYTHING, 0
        all_above = all_above and above
        if state == _PIERCED:
            pierced += 1
            pierced_face = face
    if pierced == 0:
        return WHOLE_SPHERE if all_above else NOTHING, 0
    return FACE if pierced == 1 else ANYTHING, pierced_face


@inlined
def _point(features: FloatArray, corner: int) -> Vector:
    return highs(load_vector(features, POINTS + corner))


@building_block
def _side(features: FloatArray, start: int, end: int) -> Vector:
    """Return the vector from one corner to another, rounded only at the end, from corners in double-double."""
    a, b = load_vector(features, POINTS + start), load_vector(features, POINTS + end)
    return (
        (b[0][0] - a[0][0]) + (b[0][1] - a[0][1]),
        (b[1][0] - a[1][0]) + (b[1][1] - a[1][1]),
        (b[2][0] - a[2][0]) + (b[2][1] - a[2][1]),
    )


@inlined
def _is_near(features: FloatArray, solid: np.int64, edge: int, within_2: float) -> bool:
    """Return whether a point of the edge lies nearer to the centre than the square root of `within_2` (m²)."""
    start_corner, end_corner = EDGE_ENDS[solid, edge]
    start, end = _point(features, start_corner), _point(features, end_corner)
    side = _side(features, start_corner, end_corner)
    start_2, end_2, length_2 = dot(start, start), dot(end, end), dot(side, side)
    # From the nearer end, which rounds less.
    along = -dot(start, side) if start_2 <= end_2 else dot(end, side)
    nearest_2 = min(start_2, end_2)
    if 0.0 < along < length_2:
        return nearest_2 * length_2 - along * along < within_2 * length_2
    return nearest_2 < within_2


@building_block
def _pierced(features: FloatArray, solid: np.int64, face: int, radius: float, farthest: float) -> tuple[int, bool]:
    """Return (state of a face whose sides the ball does not reach, whether the whole ball may lie below its plane).

    The second is so if the centre lies at least R below the plane, less a margin for rounding.
    """
    corners, sides = FACE_CORNERS[solid, face], SIDES[solid]
    first, second = _side(features, corners[0], corners[1]), _side(features, corners[1], corners[2])
    normal = cross(first, second)
    area_2 = math.sqrt(dot(normal, normal))
    # All distances below are multiplied by `area_2`, the length of the normal.
    margin = _MARGIN * farthest * (area_2 + math.sqrt(dot(first, first) * dot(second, second)))
    height = dot(_point(features, corners[1]), normal)
    if not margin < 0.25 * radius * area_2:
        return _UNCERTAIN, False
    above = height > radius * area_2 - margin
    if abs(height) > radius * area_2 + margin:
        return _APART, above
    state = _PIERCED
    for side in range(sides):
        end = corners[side + 1] if side + 1 < sides else corners[0]
        along = _side(features, corners[side], end)
        inside = dot(_point(features, corners[side]), cross(along, normal))
        if inside * inside <= margin * margin * dot(along, along):
            state = _UNCERTAIN
        elif inside < 0.0:
            return _APART, above
    return state, above


@inlined
def _is_one_of(number: int, numbers: IntArray, count: int) -> bool:
    """Return whether `number` is among the first `count` numbers."""
    found = False
    for index in range(count):
        found = found or numbers[index] == number
    return found
