"""Features (corners, edges, faces) of tetrahedra and boxes: tables of how they meet, and measures in double-double.

Measures are lengths, vectors and areas relative to the sphere's centre.
"""

from collections.abc import Sequence

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import dot
from robot_side.overlap.digits.double_double import (
    ZERO,
    DoubleDouble,
    divided,
    is_less,
    minus,
    negated,
    plus,
    rounded,
    square_root,
    times,
    two_product,
)
from robot_side.overlap.digits.double_double_vectors import (
    PreciseVector,
    highs,
    load_number,
    load_vector,
    precise_cross,
    precise_dot,
    precise_scale,
    precise_subtract,
    precise_unit,
    store_number,
    store_vector,
)
from robot_side.overlap.digits.expansion import exact_power

UNCERTAIN = 1e-28
"""Power R² - |p|² of a corner or edge, for R = 1, below which it is recomputed with less rounding or none"""


TETRAHEDRON, BOX = np.int64(0), np.int64(1)
"""Kinds of solid, the first index of the tables below. They are NumPy's integers, because Numba compiles a function
again for every literal Python int."""

_FACES = (
    ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)),
    ((1, 3, 7, 5), (0, 4, 6, 2), (2, 6, 7, 3), (0, 1, 5, 4), (4, 5, 7, 6), (0, 2, 3, 1)),
)
"""Corners of each face, anticlockwise as seen from outside; the tetrahedron's faces first, then the box's.

A tetrahedron's corners a, b, c, d are in an order in which (b - a) · ((c - a) × (d - a)) > 0. A box has right-handed
axes. Its corner 1·i + 2·j + 4·k lies at the upper end of the first axis if i = 1, else at the lower end; so do j and k
for the second and third axis.
"""
_EDGES = (
    [(start, end) for start in range(4) for end in range(start + 1, 4)],
    [(corner, corner + axis) for corner in range(8) for axis in (1, 2, 4) if not corner & axis],
)
_RUNS = [[list(zip(face, (*face[1:], face[0]), strict=True)) for face in faces] for faces in _FACES]
_LEFT = [{run: number for number, face in enumerate(runs) for run in face} for runs in _RUNS]
_CORNERS = (range(4), range(8))


def _table(tetrahedron: Sequence[Sequence[float]], box: Sequence[Sequence[float]]) -> IntArray:
    """Return both kinds' tables as one array, filled with zeros where the tetrahedron has fewer entries."""
    table = np.zeros((2, len(box), len(box[0])), dtype=np.int64)
    table[0, : len(tetrahedron), : len(tetrahedron[0])] = tetrahedron
    table[1] = box
    return table


CORNERS, EDGES, FACES, SIDES = np.array([[4, 8], [6, 12], [4, 6], [3, 4]])
"""Number of corners, edges, faces, and sides of a face, each (2,) by kind of solid"""
EDGE_ENDS = _table(*_EDGES)
"""(2, 12, 2) start corner and end corner of each edge, by kind of solid"""
EDGE_FACES = _table(*([(left[edge], left[edge[::-1]]) for edge in _EDGES[kind]] for kind, left in enumerate(_LEFT)))
"""(2, 12, 2) face on the left and face on the right of each edge, as seen from outside"""
PARALLEL_EDGES = np.array([range(12), [_EDGES[1].index((0, end - start)) for start, end in _EDGES[1]]])
"""(2, 12) for each edge the lowest number of an edge with the same vector; edges of a box are parallel in fours"""
FACE_CORNERS = _table(*_FACES)
"""(2, 6, 4) corners of each face"""
FACE_EDGES = _table(*([[_EDGES[kind].index((min(r), max(r))) for r in f] for f in _RUNS[kind]] for kind in range(2)))
"""(2, 6, 4) edge of each side of a face: from each corner to the face's next corner"""
FACE_SIGNS = _table(*([[1 if start < end else -1 for start, end in face] for face in runs] for runs in _RUNS))
"""(2, 6, 4) for each side of a face 1 if it runs along its edge, -1 if it runs from the edge's end to its start"""
CORNER_EDGES = _table(
    *([[n for n, edge in enumerate(_EDGES[kind]) if c in edge] for c in _CORNERS[kind]] for kind in range(2))
)
"""(2, 8, 3) edges that meet in each corner"""

# The measures of one solid are rows of an array (ROWS, 3, 2). These are the first rows of each measure:
POINTS = 0
"""First row of the corners p, relative to the sphere's centre (m)"""
LENGTHS = 8
"""First row of the corners' distances |p| from the sphere's centre (m)"""
POWERS = 16
"""First row of the corners' powers R² - |p|² (m²), positive inside the ball"""
DIRECTIONS = 24
"""First row of the edges' unit vectors"""
FEET = 36
"""First row of the edges' foot points: the point of each edge's line nearest to the sphere's centre (m)"""
STARTS, ENDS = 48, 60
"""First rows of the signed distances of each edge's start and end from the foot point (m)"""
BASES = 72
"""First row of the foot points' squared distances from the sphere's centre (m²)"""
HALF_CHORDS = 84
"""First row of the half-chords: half the length of each edge's whole line within the ball (m)"""
REACHED = 96
"""First row of flags: 1 if the edge has a point inside the ball, else 0"""
NORMALS = 108
"""First row of the faces' outward unit vectors"""
HEIGHTS = 114
"""First row of the faces' signed distances from the sphere's centre along these vectors (m)"""
MOMENTS = 120
"""First row of the faces' moments (m³): height times twice the area of a triangle of three of the face's corners"""
SQUARED_AREAS = 126
"""First row of (2 × area)² of these triangles (m⁴)"""
ROWS = 132


@building_block
def measure_corner(features: FloatArray, corner: int, radius: float) -> None:
    """Fill the length and the power of `corner` from its point and the `radius` (m)."""
    point = load_vector(features, POINTS + corner)
    distance_2 = precise_dot(point, point)
    power = minus(two_product(radius, radius), distance_2)
    if abs(power[0]) < UNCERTAIN * radius * radius:
        power = exact_power(point, radius), 0.0
    store_number(features, LENGTHS + corner, square_root(distance_2))
    store_number(features, POWERS + corner, power)


@building_block
def measure_direction(features: FloatArray, solid: np.int64, edge: int) -> None:
    """Fill the direction of `edge` from its corners."""
    start, end = EDGE_ENDS[solid, edge]
    side = precise_subtract(load_vector(features, POINTS + end), load_vector(features, POINTS + start))
    direction, _ = precise_unit(side)
    store_vector(features, DIRECTIONS + edge, direction)


@building_block
def measure_edge(features: FloatArray, solid: np.int64, edge: int, radius: float) -> None:
    """Fill `FEET` to `REACHED` of `edge` from its corners, its direction and the `radius` (m)."""
    start_corner, end_corner = EDGE_ENDS[solid, edge]
    start, end = load_vector(features, POINTS + start_corner), load_vector(features, POINTS + end_corner)
    direction = load_vector(features, DIRECTIONS + edge)
    start_along, end_along = precise_dot(start, direction), precise_dot(end, direction)
    # From the nearer end, which rounds less.
    if abs(start_along[0]) <= abs(end_along[0]):
        foot = precise_subtract(start, precise_scale(start_along, direction))
    else:
        foot = precise_subtract(end, precise_scale(end_along, direction))
    base_2 = precise_dot(foot, foot)
    half_chord_2 = minus(two_product(radius, radius), base_2)
    if abs(half_chord_2[0]) < UNCERTAIN * radius * radius:
        # Without the rounding of the direction: exact if the coordinates have few digits.
        side = precise_subtract(end, start)
        moment, length_2 = precise_cross(start, side), precise_dot(side, side)
        above = minus(times(two_product(radius, radius), length_2), precise_dot(moment, moment))
        half_chord_2 = divided(above, length_2)
    half_chord = square_root(half_chord_2)
    store_vector(features, FEET + edge, foot)
    store_number(features, STARTS + edge, start_along)
    store_number(features, ENDS + edge, end_along)
    store_number(features, BASES + edge, base_2)
    store_number(features, HALF_CHORDS + edge, half_chord)
    crosses = is_less(start_along, half_chord) and is_less(negated(half_chord), end_along)
    features[REACHED + edge, 0, 0] = 1.0 if crosses and half_chord[0] > 0.0 else 0.0


@building_block
def measure_face(features: FloatArray, solid: np.int64, face: int) -> None:
    """Fill `NORMALS` to `SQUARED_AREAS` of `face` from its corners.

    The normal comes from a triangle's two shortest sides, the height from the nearest corner, as these round least. A
    face without area gets the normal 0, so it has no effect.
    """
    corners = FACE_CORNERS[solid, face]
    a, b = load_vector(features, POINTS + corners[0]), load_vector(features, POINTS + corners[1])
    c = load_vector(features, POINTS + corners[2])
    ab, bc = precise_subtract(b, a), precise_subtract(c, b)
    nearest, nearest_2 = a, _square(a)
    for other in range(1, SIDES[solid]):
        point = load_vector(features, POINTS + corners[other])
        distance_2 = _square(point)
        if distance_2 < nearest_2:
            nearest, nearest_2 = point, distance_2
    first, second = ab, bc
    if solid == TETRAHEDRON:
        ca = precise_subtract(a, c)
        ab_2, bc_2, ca_2 = _square(ab), _square(bc), _square(ca)
        if ab_2 >= bc_2 and ab_2 >= ca_2:
            first, second = bc, ca
        elif bc_2 >= ca_2:
            first, second = ca, ab
    across = precise_cross(first, second)
    normal, area_2 = precise_unit(across)
    moment = precise_dot(across, nearest)
    store_vector(features, NORMALS + face, normal)
    store_number(features, MOMENTS + face, moment)
    store_number(features, SQUARED_AREAS + face, precise_dot(across, across))
    store_number(features, HEIGHTS + face, divided(moment, area_2) if area_2[0] > 0.0 else ZERO)


@inlined
def _square(vector: PreciseVector) -> float:
    return dot(highs(vector), highs(vector))


@inlined
def distance_in_face(features: FloatArray, solid: np.int64, face: int, side: int) -> DoubleDouble:
    """Return the signed distance d (m) of a side of `face` from the face's foot point.

    It is positive if the foot point lies on the face's side of the line.
    """
    edge, sign = FACE_EDGES[solid, face, side], FACE_SIGNS[solid, face, side]
    outward = precise_cross(load_vector(features, DIRECTIONS + edge), load_vector(features, NORMALS + face))
    distance = precise_dot(load_vector(features, FEET + edge), outward)
    return distance if sign > 0 else negated(distance)


@building_block
def measure_all(features: FloatArray, solid: np.int64, radius: float) -> None:
    """Fill all measures of a solid from its corners and the `radius` (m)."""
    for corner in range(CORNERS[solid]):
        measure_corner(features, corner, radius)
    for edge in range(EDGES[solid]):
        parallel = PARALLEL_EDGES[solid, edge]
        if parallel == edge:
            measure_direction(features, solid, edge)
        else:
            store_vector(features, DIRECTIONS + edge, load_vector(features, DIRECTIONS + parallel))
        measure_edge(features, solid, edge, radius)
    for face in range(FACES[solid]):
        measure_face(features, solid, face)


@inlined
def depth_and_rest(features: FloatArray, face: int, radius: float) -> tuple[float, float]:
    """Return (R + h, R - h) in m: the heights of the ball's parts inside and outside the plane of `face`.

    h is the face's signed distance from the centre, so R + h is small where the ball only just reaches the solid.
    """
    height = load_number(features, HEIGHTS + face)
    depth, rest = plus((radius, 0.0), height), minus((radius, 0.0), height)
    if depth[0] < UNCERTAIN * radius:
        # R² - h² without the rounding of the normal: exact if the coordinates have few digits.
        area_2, moment = load_number(features, SQUARED_AREAS + face), load_number(features, MOMENTS + face)
        above = minus(times(two_product(radius, radius), area_2), times(moment, moment))
        depth = divided(above, times(area_2, rest))
    return rounded(depth), rounded(rest)
