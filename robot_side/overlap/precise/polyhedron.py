"""Overlap of a sphere with a tetrahedron or a box, as accurate as the input allows, however small the overlap is.

The overlap is the sum over faces in double-double (`face_sum`). Its error is about 1e-31 of the sphere's volume, or
more if the solid is much larger than the sphere. If the ball reaches only one face, or only just reaches one edge or
corner, the overlap has a form in which nothing cancels (`cap`, `local_forms`). The form of the feature that reaches
deepest into the ball replaces the sum where both agree within the sum's error, and where the sum is below this error.
"""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import scale
from robot_side.overlap.digits.double_double import rounded, times
from robot_side.overlap.digits.double_double_vectors import (
    PreciseVector,
    highs,
    load_number,
    load_vector,
    precise_cross,
    precise_negative,
)
from robot_side.overlap.precise.face_sum import sum_over_faces
from robot_side.overlap.precise.features import (
    CORNER_EDGES,
    CORNERS,
    DIRECTIONS,
    EDGE_ENDS,
    EDGE_FACES,
    EDGES,
    ENDS,
    FACES,
    FEET,
    HALF_CHORDS,
    HEIGHTS,
    LENGTHS,
    NORMALS,
    POINTS,
    POWERS,
    SIDES,
    STARTS,
    depth_and_rest,
    distance_in_face,
    measure_all,
)
from robot_side.overlap.precise.local_forms import SHARP_CORNER, SHARP_EDGE, corner_overlap, edge_overlap
from robot_side.overlap.solids.half_space import cap
from robot_side.overlap.solids.solid import Overlap, bounded, nothing, whole_solid, whole_sphere

NOTHING, WHOLE_SPHERE, FACE, EDGE, CORNER = 0, 1, 2, 3, 4
"""Kinds of what the ball reaches"""

_LOCAL = 1e-12
"""Bound of the relative error of a local form that applies"""

NOISE = 1e-29
"""Bound of the rounding error of a sum over faces, as a share of R³, or of R² times the distance of the farthest corner
if that is larger"""


@building_block
def polyhedron_overlap(features: FloatArray, solid: np.int64, radius: float, solid_volume: float) -> Overlap:
    """Return the overlap of the ball about the origin with a solid whose corners are in `features`; 1 <= `radius` < 2.

    `solid` is the kind, TETRAHEDRON or BOX. `solid_volume` is exact enough to be 0 only for a solid without volume.
    """
    if solid_volume == 0.0 or radius == 0.0:
        return nothing()
    if _is_inside(features, solid, radius):
        # The solid may be so small that its directions and angles are not finite.
        return whole_solid(solid_volume)
    measure_all(features, solid, radius)
    farthest, inside = 0.0, 0
    for corner in range(CORNERS[solid]):
        farthest = max(farthest, features[LENGTHS + corner, 0, 0])
        inside += 1 if features[POWERS + corner, 0, 0] >= 0.0 else 0
    if inside == CORNERS[solid]:
        return whole_solid(solid_volume)
    summed = bounded(sum_over_faces(features, solid, radius), radius, solid_volume)
    noise = NOISE * radius * radius * max(radius, farthest)
    reached, number = _deepest(features, solid, radius)
    local, sharpness = _local_form(features, solid, radius, reached, number)
    sharp = sharpness < (SHARP_CORNER if reached == CORNER else SHARP_EDGE)
    if sharp and abs(local[0] - summed[0]) <= noise + _LOCAL * local[0]:
        # The ball reaches nothing else of the solid.
        return bounded(local, radius, solid_volume)
    if summed[0] > noise:
        return summed
    most = min(noise, solid_volume)
    # A corner or edge within the ball has some volume there, even if its faces coincide by rounding.
    thin = most if reached in (CORNER, EDGE) else 0.0
    return _below_noise(local, summed, most, thin, radius)


@inlined
def _is_inside(features: FloatArray, solid: np.int64, radius: float) -> bool:
    """Return whether the ball contains all corners, by a margin larger than rounding errors."""
    farthest_2 = 0.0
    for corner in range(CORNERS[solid]):
        x, y, z = features[POINTS + corner, 0, 0], features[POINTS + corner, 1, 0], features[POINTS + corner, 2, 0]
        farthest_2 = max(farthest_2, x * x + y * y + z * z)
    return bool(farthest_2 < (1.0 - 1e-9) * radius * radius)


@inlined
def _below_noise(local: Overlap, summed: Overlap, most: float, thin: float, radius: float) -> Overlap:
    """Return the overlap for a sum whose volume is below its rounding error: the local form of a single feature.

    Gradient and area are the sum's, if its area is above the rounding error. The volume is cut to `most`; it is `thin`
    if the local form has none.
    """
    volume, gradient, area = local
    volume = thin if volume == 0.0 else volume
    if volume == 0.0:
        return nothing()
    most_area = NOISE * radius * radius
    if summed[2] > most_area:
        return min(volume, most), summed[1], summed[2]
    share = most_area / area if area > most_area else 1.0
    return min(volume, most), scale(share, gradient), share * area


@building_block
def _local_form(
    features: FloatArray, solid: np.int64, radius: float, reached: int, number: int
) -> tuple[Overlap, float]:
    """Return the overlap with the reached feature alone, and its sharpness: the smaller, the more accurate; 0 is exact.

    The sharpness is infinite if there is no such form.
    """
    overlap, sharpness = nothing(), math.inf
    if reached == NOTHING:
        sharpness = 0.0
    elif reached == WHOLE_SPHERE:
        overlap, sharpness = whole_sphere(radius), 0.0
    elif reached == FACE:
        depth, rest = depth_and_rest(features, number, radius)
        overlap, sharpness = cap(depth, rest, radius, highs(load_vector(features, NORMALS + number))), 0.0
    elif reached == EDGE and features[HALF_CHORDS + number, 0, 0] > 0.0:
        overlap, sharpness = _edge_wedge(features, solid, number, radius)
    elif reached == CORNER and features[POWERS + number, 0, 0] > 0.0:
        overlap, sharpness = _corner_cone(features, solid, number, radius)
    return overlap, sharpness


@building_block
def _deepest(features: FloatArray, solid: np.int64, radius: float) -> tuple[int, int]:
    """Return (kind, number) of the feature that reaches deepest into the ball.

    It is the deepest corner in the ball; without any, the deepest edge; without any, a face that the ball reaches.
    Without any, the ball lies within the solid (`WHOLE_SPHERE`) or outside (`NOTHING`).
    """
    deepest, reached, number = 0.0, NOTHING, 0
    for corner in range(CORNERS[solid]):
        if features[POWERS + corner, 0, 0] > deepest:
            deepest, reached, number = features[POWERS + corner, 0, 0], CORNER, corner
    if reached == NOTHING:
        for edge in range(EDGES[solid]):
            # An edge that does not contain its line's nearest point is no deeper than its corners.
            passes = features[STARTS + edge, 0, 0] < 0.0 < features[ENDS + edge, 0, 0]
            if passes and features[HALF_CHORDS + edge, 0, 0] > deepest:
                deepest, reached, number = features[HALF_CHORDS + edge, 0, 0], EDGE, edge
    if reached == NOTHING:
        reached = WHOLE_SPHERE
        for face in range(FACES[solid]):
            height = features[HEIGHTS + face, 0, 0]
            if height < radius and reached == WHOLE_SPHERE:
                reached = NOTHING
            pierced = abs(height) <= radius
            for side in range(SIDES[solid]):
                pierced = pierced and distance_in_face(features, solid, face, side)[0] > 0.0
            if pierced:
                reached, number = FACE, face
    return reached, number


@inlined
def _edge_wedge(features: FloatArray, solid: np.int64, edge: int, radius: float) -> tuple[Overlap, float]:
    direction = load_vector(features, DIRECTIONS + edge)
    sides = (
        precise_cross(load_vector(features, NORMALS + EDGE_FACES[solid, edge, 0]), direction),
        precise_cross(direction, load_vector(features, NORMALS + EDGE_FACES[solid, edge, 1])),
    )
    half_chord = load_number(features, HALF_CHORDS + edge)
    power = rounded(times(half_chord, half_chord))
    return edge_overlap(load_vector(features, FEET + edge), power, sides, radius)


@inlined
def _corner_cone(features: FloatArray, solid: np.int64, corner: int, radius: float) -> tuple[Overlap, float]:
    own = CORNER_EDGES[solid, corner]
    edges = (
        _away_from(features, solid, corner, own[0]),
        _away_from(features, solid, corner, own[1]),
        _away_from(features, solid, corner, own[2]),
    )
    power = rounded(load_number(features, POWERS + corner))
    return corner_overlap(load_vector(features, POINTS + corner), power, edges, radius)


@inlined
def _away_from(features: FloatArray, solid: np.int64, corner: int, edge: int) -> PreciseVector:
    """Return the unit vector of an edge from its end `corner` to its other end."""
    direction = load_vector(features, DIRECTIONS + edge)
    return direction if EDGE_ENDS[solid, edge, 0] == corner else precise_negative(direction)
