"""The nearest point of a primitive's surface: how far, which way, and how surely that is the way out.

Point i is paired with primitive i throughout; the points are (p, 3), in the primitives' frame. The *signed
distance* is positive outside and negative inside. The *direction* is the unit vector along which it falls
fastest, its negative gradient: outside it points at the nearest point of the surface; inside it points away
from that, so that moving along it deepens the penetration and moving against it is the shortest way out. It
is the same just outside and just inside a face. Where several points are equally near, one is taken.

Inside, the direction jumps where two ways out are equally short: in the middle of a plate, say. The
`*_deepening` functions are for points inside only and give its continuous relative: a mean over the ways out
that leaves less of itself the more they contradict each other. It has length 1 at a face, 0 in the middle of
a plate or of a sphere.

Nothing is validated here: centres are checked in `proximity`, primitives once for each frame.
"""

import numpy as np

from common.arrays import BoolArray, FloatArray

_ANY_DIRECTION = np.array([0.0, 0.0, 1.0])
"""For a point in the centre of a sphere, from which every way out is as long."""

_WAY_OUT_EXPONENT = 4
"""Ways out count by length^-4: one 1.8 times as long as the shortest counts a tenth of it."""

_EDGE_FROM = np.array([0, 0, 0, 1, 1, 2])
_EDGE_TO = np.array([1, 2, 3, 2, 3, 3])
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Face k lies opposite vertex k; its order is outward where the vertices 0 to 3 are positively oriented."""
_FACE_ROWS = np.arange(4)[:, None]
_FACE_EDGES = np.array([[3, 5, 4], [2, 5, 1], [0, 4, 2], [1, 3, 0]])
_FACE_EDGE_SIGNS = np.array([[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, -1.0]])
"""The three edges around each face, as rows of the six above, and -1 where the face goes against one."""
_NEXT = np.array([1, 2, 0])
_AFTER_NEXT = np.array([2, 0, 1])


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    result: FloatArray = np.einsum("...i,...i->...", a, b)
    return result


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """a x b over the last axis; np.cross takes several times as long for a few dozen vectors."""
    return a[..., _NEXT] * b[..., _AFTER_NEXT] - a[..., _AFTER_NEXT] * b[..., _NEXT]


def nearest_on_sphere(
    points_m: FloatArray, centers_m: FloatArray, radii_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to spheres (centers (p, 3), radii (p,))."""
    offset = centers_m - points_m
    distance = np.sqrt(_dot(offset, offset))
    central = distance == 0.0
    if central.any():
        offset[central] = _ANY_DIRECTION
        return distance - radii_m, offset / np.where(central, 1.0, distance)[:, None]
    return distance - radii_m, offset / distance[:, None]


def nearest_on_box(
    points_m: FloatArray, centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to boxes.

    centers (p, 3), rotations (p, 3, 3) box to world, half sizes (p, 3).
    """
    local = _to_box(points_m, centers_m, rotations)
    beyond = np.abs(local) - half_sizes_m
    outward = np.maximum(beyond, 0.0)
    distance = np.sqrt(_dot(outward, outward))
    inside = distance == 0.0
    if inside.any():
        rows = np.flatnonzero(inside)
        axis = beyond[rows].argmax(axis=1)
        distance[rows] = beyond[rows, axis]
        outward[rows, axis] = 1.0
    outward = np.copysign(outward / np.where(inside, 1.0, distance)[:, None], local)
    return distance, -np.einsum("pij,pj->pi", rotations, outward)


def nearest_on_tetrahedron(points_m: FloatArray, vertices_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to tetrahedra (p, 4, 3), in any vertex order.

    One of zero volume is a flat plate without an inside.
    """
    vertices = vertices_m - points_m[:, None, :]
    height, normal, foot_inside, solid = _tetrahedron_faces(vertices)
    start = vertices[:, _EDGE_FROM]
    edge = vertices[:, _EDGE_TO] - start
    squared_length = _dot(edge, edge)
    along = np.clip(-_dot(start, edge) / np.where(squared_length > 0.0, squared_length, 1.0), 0.0, 1.0)
    feet = np.concatenate([start + along[..., None] * edge, -height[..., None] * normal], axis=1)
    squared = _dot(feet, feet)
    # A foot that rounding puts just off its face does no harm: the edge there is as near.
    squared[:, 6:][~foot_inside] = np.inf
    rows = np.arange(len(points_m))
    best = squared.argmin(axis=1)
    distance = np.sqrt(squared[rows, best])
    outside = ~(solid & (height <= 0.0).all(axis=1)) & (distance > 0.0)
    direction = feet[rows, best] / np.where(outside, distance, 1.0)[:, None]
    if not outside.all():
        rows = np.flatnonzero(~outside)
        highest = height[rows].argmax(axis=1)
        distance[rows] = height[rows, highest]
        direction[rows] = -normal[rows, highest]
        # On a tetrahedron without any area there is no face to take the normal of.
        direction[rows[~direction[rows].any(axis=1)]] = _ANY_DIRECTION
    return distance, direction


def nearest_on_half_space(
    points_m: FloatArray, normals: FloatArray, offsets_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to half-spaces, solid where normal·x <= offset."""
    return _dot(normals, points_m) - offsets_m, -normals


def sphere_deepening(points_m: FloatArray, centers_m: FloatArray, radii_m: FloatArray) -> FloatArray:
    """Deepening vectors (p, 3) inside spheres: the ways out are the nearest and the opposite one."""
    offset = centers_m - points_m
    distance = np.sqrt(_dot(offset, offset))
    shortest = radii_m - distance
    weight = (shortest / (radii_m + distance)) ** _WAY_OUT_EXPONENT
    length = (1.0 - weight) / (1.0 + weight)
    deepening: FloatArray = offset * (length / np.where(distance > 0.0, distance, 1.0))[:, None]
    return deepening


def box_deepening(
    points_m: FloatArray, centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray
) -> FloatArray:
    """Deepening vectors (p, 3) inside boxes: the ways out are those through the six faces."""
    local = _to_box(points_m, centers_m, rotations)
    weights = _way_out_weights(np.concatenate([half_sizes_m - local, half_sizes_m + local], axis=1))
    deepening: FloatArray = np.einsum("pij,pj->pi", rotations, weights[:, 3:] - weights[:, :3])
    return deepening


def tetrahedron_deepening(points_m: FloatArray, vertices_m: FloatArray) -> FloatArray:
    """Deepening vectors (p, 3) inside tetrahedra: the ways out are those through the four faces."""
    height, normal, _, _ = _tetrahedron_faces(vertices_m - points_m[:, None, :])
    deepening: FloatArray = -np.einsum("pf,pfi->pi", _way_out_weights(-height), normal)
    return deepening


def _way_out_weights(lengths_m: FloatArray) -> FloatArray:
    """Weights (p, f) of ways out of `lengths_m` (p, f), their sum 1; one of length 0 is the only one."""
    shortest = np.maximum(lengths_m.min(axis=1, keepdims=True), 0.0)
    longer = lengths_m > shortest
    weights = (np.where(longer, shortest, 1.0) / np.where(longer, lengths_m, 1.0)) ** _WAY_OUT_EXPONENT
    result: FloatArray = weights / weights.sum(axis=1, keepdims=True)
    return result


def _to_box(points_m: FloatArray, centers_m: FloatArray, rotations: FloatArray) -> FloatArray:
    """The points in the boxes' own axes."""
    local: FloatArray = np.einsum("pji,pj->pi", rotations, points_m - centers_m)
    return local


def _tetrahedron_faces(vertices: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray]:
    """Faces as seen from the origin, for vertices (p, 4, 3) relative to the point.

    The origin's signed heights (p, 4) over the faces' planes, the outward unit normals (p, 4, 3), whether the
    origin's foot lies within the face (p, 4) and whether the tetrahedron has a volume (p,).
    """
    a = vertices[:, _FACES[:, 0]]
    raw = _cross(vertices[:, _FACES[:, 1]] - a, vertices[:, _FACES[:, 2]] - a)
    length = np.sqrt(_dot(raw, raw))
    wide: BoolArray = length > 0.0
    # The foot lies on the inner side of the edge from u to v where raw · (u x v) >= 0.
    edge_moments = _cross(vertices[:, _EDGE_FROM], vertices[:, _EDGE_TO])
    sides = np.matmul(raw, edge_moments.swapaxes(1, 2))[:, _FACE_ROWS, _FACE_EDGES] * _FACE_EDGE_SIGNS
    foot_inside: BoolArray = wide & (sides >= 0.0).all(axis=2)
    six_volumes = -_dot(raw[:, 0], vertices[:, 0] - a[:, 0])
    solid: BoolArray = six_volumes != 0.0
    normal = raw * (np.where(six_volumes < 0.0, -1.0, 1.0)[:, None] / np.where(wide, length, 1.0))[..., None]
    return -_dot(normal, a), normal, foot_inside, solid
