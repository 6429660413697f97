"""The overlap of a sphere with a tetrahedron or a box, to the accuracy of the input at every size of the overlap.

Caps, and lone edges and corners that hardly reach the ball, have forms of their own, in which nothing cancels. All
else is the sum over faces in double-double. That leaves about 1e-31 of the sphere's volume, more if the solid is much
larger than the sphere; what comes out smaller than that is replaced by the form of the feature reached deepest.
"""

import math

from robot_side.overlap.compile import building_block, inlined
from robot_side.overlap.double_double import minus, plus, rounded, two_product
from robot_side.overlap.double_double_vectors import (
    PreciseVector,
    highs,
    load_number,
    load_vector,
    precise_cross,
    precise_negative,
)
from robot_side.overlap.half_space import cap
from robot_side.overlap.local_forms import SHARP_CORNER, SHARP_EDGE, corner_overlap, edge_overlap
from robot_side.overlap.polyhedron_features import (
    Features,
    Topology,
    distance_in_face,
    measure_all,
    measure_corner,
    measure_direction,
    measure_edge,
    measure_face,
)
from robot_side.overlap.precise_sum import sum_over_faces
from robot_side.overlap.screening import CORNER, EDGE, FACE, NOTHING, WHOLE_SPHERE, screened
from robot_side.overlap.solid import Overlap, bounded, nothing, whole_solid, whole_sphere

NOISE = 1e-30
"""What rounding may leave of a sum over faces, as a fraction of R³ and per (size of the solid) / R if that is above 1."""


@building_block
def polyhedron_overlap(features: Features, topology: Topology, radius: float, solid_volume: float) -> Overlap:
    """The overlap of the ball about the origin with the solid of corners `features.points`; 1 <= `radius` < 2.

    `solid_volume` is the solid's volume, which is 0 for nothing else than a solid without volume.
    """
    if solid_volume == 0.0 or radius == 0.0:
        return nothing()
    what, number = screened(features, topology, radius)
    sharpness, sharp = math.inf, 0.0
    overlap = nothing()
    if what == NOTHING:
        return nothing()
    if what == WHOLE_SPHERE:
        return whole_sphere(radius)
    if what == FACE:
        measure_face(features, topology, number)
        return bounded(_face_cap(features, number, radius), radius, solid_volume)
    if what == EDGE:
        measure_direction(features, topology, number)
        measure_edge(features, topology, number, radius)
        measure_face(features, topology, topology.edge_faces[number, 0])
        measure_face(features, topology, topology.edge_faces[number, 1])
        if features.edges[number, 3, 0] > 0.0:
            sharp = SHARP_EDGE
            overlap, sharpness = _edge_wedge(features, topology, number, radius)
    if what == CORNER:
        measure_corner(features, number, radius)
        if features.corners[number, 1, 0] > 0.0:
            for own in topology.corner_edges[number]:
                measure_direction(features, topology, own)
            sharp = SHARP_CORNER
            overlap, sharpness = _corner_cone(features, topology, number, radius)
    if sharpness < sharp:
        return bounded(overlap, radius, solid_volume)
    return _any_overlap(features, topology, radius, solid_volume)


@building_block
def _any_overlap(features: Features, topology: Topology, radius: float, solid_volume: float) -> Overlap:
    measure_all(features, topology, radius)
    corners = topology.corner_edges.shape[0]
    farthest, inside = 0.0, 0
    for corner in range(corners):
        farthest = max(farthest, features.corners[corner, 0, 0])
        inside += 1 if features.corners[corner, 1, 0] >= 0.0 else 0
    if inside == corners:
        return whole_solid(solid_volume)
    overlap = bounded(sum_over_faces(features, topology, radius), radius, solid_volume)
    noise = NOISE * radius * radius * max(radius, farthest)
    if overlap[0] > noise:
        return overlap
    return bounded(_deepest(features, topology, radius), radius, min(solid_volume, noise))


@building_block
def _deepest(features: Features, topology: Topology, radius: float) -> Overlap:
    """The form of the corner, else edge, else face that reaches deepest into the ball."""
    deepest, number = 0.0, 0
    for corner in range(topology.corner_edges.shape[0]):
        if features.corners[corner, 1, 0] > deepest:
            deepest, number = features.corners[corner, 1, 0], corner
    if deepest > 0.0:
        overlap, _ = _corner_cone(features, topology, number, radius)
        return overlap
    for edge in range(topology.edge_ends.shape[0]):
        if features.reached[edge] > 0.0 and features.edges[edge, 3, 0] > deepest:
            deepest, number = features.edges[edge, 3, 0], edge
    if deepest > 0.0:
        overlap, _ = _edge_wedge(features, topology, number, radius)
        return overlap
    overlap = nothing()
    for face in range(topology.face_corners.shape[0]):
        inside = features.faces[face, 0, 0] < 0.0
        for side in range(topology.face_corners.shape[1]):
            inside = inside and distance_in_face(features, topology, face, side)[0] > 0.0
        if inside:
            overlap = _face_cap(features, face, radius)
    return overlap


@inlined
def _face_cap(features: Features, face: int, radius: float) -> Overlap:
    height = load_number(features.faces, face, 0)
    depth, rest = rounded(plus((radius, 0.0), height)), rounded(minus((radius, 0.0), height))
    return cap(depth, rest, radius, highs(load_vector(features.normals, face)))


@building_block
def _edge_wedge(features: Features, topology: Topology, edge: int, radius: float) -> tuple[Overlap, float]:
    direction = load_vector(features.directions, edge)
    left, right = topology.edge_faces[edge]
    sides = (
        precise_cross(load_vector(features.normals, left), direction),
        precise_cross(direction, load_vector(features.normals, right)),
    )
    power = rounded(minus(two_product(radius, radius), load_number(features.edges, edge, 2)))
    return edge_overlap(load_vector(features.feet, edge), power, sides, radius)


@inlined
def _away_from(features: Features, topology: Topology, corner: int, edge: int) -> PreciseVector:
    """The direction of an edge from one of its ends to the other."""
    direction = load_vector(features.directions, edge)
    return direction if topology.edge_ends[edge, 0] == corner else precise_negative(direction)


@building_block
def _corner_cone(features: Features, topology: Topology, corner: int, radius: float) -> tuple[Overlap, float]:
    own = topology.corner_edges[corner]
    edges = (
        _away_from(features, topology, corner, own[0]),
        _away_from(features, topology, corner, own[1]),
        _away_from(features, topology, corner, own[2]),
    )
    power = rounded(load_number(features.corners, corner, 1))
    return corner_overlap(load_vector(features.points, corner), power, edges, radius)
