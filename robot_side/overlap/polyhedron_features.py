"""Corners, edges and faces of tetrahedra and boxes, and their measures from the sphere's centre in double-double."""

from typing import NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.overlap.compile import building_block, inlined
from robot_side.overlap.double_double import (
    ZERO,
    DoubleDouble,
    divided,
    is_less,
    minus,
    negated,
    square_root,
    two_product,
)
from robot_side.overlap.double_double_vectors import (
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
from robot_side.overlap.expansion import exact_power

UNCERTAIN = 1e-28
"""Powers of corners below this, for R = 1, are taken again without rounding."""


class Topology(NamedTuple):
    """The features of a kind of solid by number, anticlockwise as seen from outside."""

    edge_ends: IntArray
    """(edges, 2): start and end corner."""
    parallel_edges: IntArray
    """(edges,): an edge of the same vector, at most its own number."""
    edge_faces: IntArray
    """(edges, 2): the face on the left and on the right of the edge as seen from outside."""
    face_corners: IntArray
    """(faces, 3 or 4)."""
    face_edges: IntArray
    """(faces, 3 or 4): the edge from each corner to the next one."""
    face_signs: FloatArray
    """(faces, 3 or 4): 1 where the face runs along that edge, -1 where against it."""
    corner_edges: IntArray
    """(corners, 3): the edges that meet in the corner."""
    corner_faces: IntArray
    """(corners, 3): the faces that meet in the corner."""


def _topology(faces: tuple[tuple[int, ...], ...], edges: list[tuple[int, int]], parallel: list[int]) -> Topology:
    runs = [list(zip(face, (*face[1:], face[0]), strict=True)) for face in faces]
    left = {run: number for number, face in enumerate(runs) for run in face}
    corners = range(1 + max(max(edge) for edge in edges))
    return Topology(
        edge_ends=np.array(edges),
        parallel_edges=np.array(parallel),
        edge_faces=np.array([(left[edge], left[edge[::-1]]) for edge in edges]),
        face_corners=np.array(faces),
        face_edges=np.array([[edges.index((min(run), max(run))) for run in face] for face in runs]),
        face_signs=np.array([[1.0 if run[0] < run[1] else -1.0 for run in face] for face in runs]),
        corner_edges=np.array([[n for n, edge in enumerate(edges) if c in edge] for c in corners]),
        corner_faces=np.array([[n for n, face in enumerate(faces) if c in face] for c in corners]),
    )


TETRAHEDRON = _topology(
    ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)), [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)], [0, 1, 2, 3, 4, 5]
)
"""Corners in the order in which (b - a) · ((c - a) × (d - a)) > 0."""
BOX = _topology(
    ((1, 3, 7, 5), (0, 4, 6, 2), (2, 6, 7, 3), (0, 1, 5, 4), (4, 5, 7, 6), (0, 2, 3, 1)),
    [(corner, corner + axis) for corner in range(8) for axis in (1, 2, 4) if not corner & axis],
    [index for corner in range(8) for index, axis in enumerate((1, 2, 4)) if not corner & axis],
)
"""Corner 1·i + 2·j + 4·k lies at the upper end of the first axis where i = 1, and so on; right-handed axes."""


class Features(NamedTuple):
    """Room for the measures of one solid from the sphere's centre; double-double in the last dimension."""

    points: FloatArray
    """(corners, 3, 2): relative to the centre."""
    corners: FloatArray
    """(corners, 2, 2): the distance |p| and the power R² - |p|²."""
    directions: FloatArray
    """(edges, 3, 2): unit vectors."""
    feet: FloatArray
    """(edges, 3, 2): the point of the edge's line nearest to the centre."""
    edges: FloatArray
    """(edges, 4, 2): start and end along the edge from that point, its squared distance, half of the chord."""
    reached: FloatArray
    """(edges,): 1 where the edge has a point inside the ball, else 0."""
    normals: FloatArray
    """(faces, 3, 2): outward unit vectors."""
    faces: FloatArray
    """(faces, 2, 2): the signed distance h, and h times twice the area of the triangle of three corners."""


@inlined
def new_features() -> Features:
    """Room for a tetrahedron or a box."""
    return Features(
        np.empty((8, 3, 2)),
        np.empty((8, 2, 2)),
        np.empty((12, 3, 2)),
        np.empty((12, 3, 2)),
        np.empty((12, 4, 2)),
        np.empty(12),
        np.empty((6, 3, 2)),
        np.empty((6, 2, 2)),
    )


@building_block
def measure_corner(features: Features, corner: int, radius: float) -> None:
    """Fill in the measures of `corner` from `points` and the `radius` (m)."""
    point = load_vector(features.points, corner)
    distance_2 = precise_dot(point, point)
    power = minus(two_product(radius, radius), distance_2)
    if abs(power[0]) < UNCERTAIN * radius * radius:
        power = exact_power(point, radius), 0.0
    store_number(features.corners, corner, 0, square_root(distance_2))
    store_number(features.corners, corner, 1, power)


@building_block
def measure_direction(features: Features, topology: Topology, edge: int) -> None:
    """Fill in the direction of `edge` from `points`."""
    start, end = topology.edge_ends[edge]
    side = precise_subtract(load_vector(features.points, end), load_vector(features.points, start))
    direction, _ = precise_unit(side)
    store_vector(features.directions, edge, direction)


@building_block
def measure_edge(features: Features, topology: Topology, edge: int, radius: float) -> None:
    """Fill in the measures of `edge` from `points`, `directions` and the `radius` (m)."""
    start_corner, end_corner = topology.edge_ends[edge]
    start, end = load_vector(features.points, start_corner), load_vector(features.points, end_corner)
    direction = load_vector(features.directions, edge)
    start_along, end_along = precise_dot(start, direction), precise_dot(end, direction)
    # From the nearer end, as it rounds less.
    if abs(start_along[0]) <= abs(end_along[0]):
        foot = precise_subtract(start, precise_scale(start_along, direction))
    else:
        foot = precise_subtract(end, precise_scale(end_along, direction))
    base_2 = precise_dot(foot, foot)
    half_chord = square_root(minus(two_product(radius, radius), base_2))
    store_vector(features.feet, edge, foot)
    store_number(features.edges, edge, 0, start_along)
    store_number(features.edges, edge, 1, end_along)
    store_number(features.edges, edge, 2, base_2)
    store_number(features.edges, edge, 3, half_chord)
    crosses = is_less(start_along, half_chord) and is_less(negated(half_chord), end_along)
    features.reached[edge] = 1.0 if crosses and half_chord[0] > 0.0 else 0.0


@building_block
def measure_face(features: Features, topology: Topology, face: int) -> None:
    """Fill in the normal and the distances of `face` from `points`.

    The two shortest sides give the normal and the nearest corner the distance, as these round least. A face
    without area gets the normal 0, and so counts for nothing.
    """
    corners = topology.face_corners[face]
    a, b = load_vector(features.points, corners[0]), load_vector(features.points, corners[1])
    c = load_vector(features.points, corners[2])
    ab, bc = precise_subtract(b, a), precise_subtract(c, b)
    nearest, nearest_2 = a, precise_dot(a, a)[0]
    for other in range(1, corners.size):
        point = load_vector(features.points, corners[other])
        distance_2 = precise_dot(point, point)[0]
        if distance_2 < nearest_2:
            nearest, nearest_2 = point, distance_2
    first, second = ab, bc
    if corners.size == 3:
        ca = precise_subtract(a, c)
        ab_2, bc_2, ca_2 = precise_dot(ab, ab)[0], precise_dot(bc, bc)[0], precise_dot(ca, ca)[0]
        if ab_2 >= bc_2 and ab_2 >= ca_2:
            first, second = bc, ca
        elif bc_2 >= ca_2:
            first, second = ca, ab
    across = precise_cross(first, second)
    normal, area_2 = precise_unit(across)
    moment = precise_dot(across, nearest)
    store_vector(features.normals, face, normal)
    store_number(features.faces, face, 1, moment)
    store_number(features.faces, face, 0, divided(moment, area_2) if area_2[0] > 0.0 else ZERO)


@inlined
def distance_in_face(features: Features, topology: Topology, face: int, side: int) -> DoubleDouble:
    """The signed distance d (m) of a side of `face` from the face's foot point, positive if that lies inside."""
    edge, sign = topology.face_edges[face, side], topology.face_signs[face, side]
    outward = precise_cross(load_vector(features.directions, edge), load_vector(features.normals, face))
    distance = precise_dot(load_vector(features.feet, edge), outward)
    return distance if sign > 0.0 else negated(distance)


@building_block
def measure_all(features: Features, topology: Topology, radius: float) -> None:
    """Fill in everything from `points` and the `radius` (m)."""
    for corner in range(topology.corner_edges.shape[0]):
        measure_corner(features, corner, radius)
    for edge in range(topology.edge_ends.shape[0]):
        parallel = topology.parallel_edges[edge]
        if parallel == edge:
            measure_direction(features, topology, edge)
        else:
            store_vector(features.directions, edge, load_vector(features.directions, parallel))
        measure_edge(features, topology, edge, radius)
    for face in range(topology.face_corners.shape[0]):
        measure_face(features, topology, face)
