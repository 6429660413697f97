"""One sphere and one box (eq. 11)."""

import math

from robot_side.overlap.compile import building_block, inlined
from robot_side.overlap.faces import parallelogram_face
from robot_side.overlap.solid import Overlap, bounded, from_faces, nothing, untouched, whole_solid, whole_sphere
from robot_side.overlap.vectors import Vector, add, cross, dot, negative, norm, scale, subtract, unit

HalfEdges = tuple[Vector, Vector, Vector]
"""Half of each edge that meets in a corner (m): half size times column of the rotation."""


@inlined
def box_overlap(center: Vector, radius: float, box_center: Vector, half_edges: HalfEdges) -> Overlap:
    """The overlap of the sphere (`center`, `radius`) with the box {box_center + Σ xᵢ half_edgesᵢ: |xᵢ| <= 1}.

    The edges are taken as they are: with a rotation that is orthonormal only to single precision, this is
    the volume of the very parallelepiped which that rotation makes. All in m. Without volume, or with a
    radius of 0, everything returned is 0. Finite input, a radius >= 0 and edges that are perpendicular to
    within 1e-6 are taken for granted.
    """
    overlap, solid_volume = box_sum(center, radius, box_center, half_edges)
    return bounded(overlap, radius, solid_volume)


@building_block
def box_sum(center: Vector, radius: float, box_center: Vector, half_edges: HalfEdges) -> tuple[Overlap, float]:
    """The overlap before its bounds are applied, and the box's volume (m³, 0 where not needed)."""
    u, v, w = half_edges
    volume_8th = dot(u, cross(v, w))
    if volume_8th == 0.0 or radius == 0.0:
        return nothing(), 0.0
    if volume_8th < 0.0:
        # Turning an axis round leaves the set as it is and makes the edges right-handed.
        volume_8th, u = -volume_8th, negative(u)
    solid_volume = 8.0 * volume_8th

    middle = subtract(box_center, center)
    apart_2 = dot(middle, middle)
    diagonal_2 = dot(u, u) + dot(v, v) + dot(w, w)
    reach = radius + 1.00001 * math.sqrt(diagonal_2)
    if apart_2 >= reach * reach:
        return nothing(), 0.0
    # The corners' mean squared distance is cheaper than their greatest, and no greater.
    if apart_2 + diagonal_2 <= radius * radius and _farthest_2(middle, u, v, w) <= radius * radius:
        return whole_solid(solid_volume), solid_volume

    cross_u, cross_v, cross_w = cross(v, w), cross(w, u), cross(u, v)
    area_u, area_v, area_w = 8.0 * norm(cross_u), 8.0 * norm(cross_v), 8.0 * norm(cross_w)
    normal_u, normal_v, normal_w = unit(cross_u), unit(cross_v), unit(cross_w)
    heights_u = _heights(middle, u, normal_u)
    heights_v = _heights(middle, v, normal_v)
    heights_w = _heights(middle, w, normal_w)
    lowest = min(heights_u[0], heights_u[1], heights_v[0], heights_v[1], heights_w[0], heights_w[1])
    if lowest <= -radius:
        return nothing(), 0.0
    if lowest >= radius:
        return whole_sphere(radius), solid_volume

    along_u, along_v, along_w = unit(u), unit(v), unit(w)
    pair_u = _opposite_faces(middle, u, (v, w), (along_v, along_w), normal_u, heights_u, area_u, radius)
    pair_v = _opposite_faces(middle, v, (w, u), (along_w, along_u), normal_v, heights_v, area_v, radius)
    pair_w = _opposite_faces(middle, w, (u, v), (along_u, along_v), normal_w, heights_w, area_w, radius)
    if not (pair_u[3] or pair_v[3] or pair_w[3]):
        return untouched(lowest, radius), solid_volume
    push = add(add(scale(pair_u[1], normal_u), scale(pair_v[1], normal_v)), scale(pair_w[1], normal_w))
    moment, covered = pair_u[0] + pair_v[0] + pair_w[0], pair_u[2] + pair_v[2] + pair_w[2]
    return from_faces(moment, push, covered, radius), solid_volume


@inlined
def _heights(middle: Vector, half_edge: Vector, normal: Vector) -> tuple[float, float]:
    """The signed distances (m) of the two faces across `half_edge` along their outward normals ±`normal`."""
    half_depth, shift = dot(half_edge, normal), dot(middle, normal)
    return half_depth + shift, half_depth - shift


@inlined
def _farthest_2(middle: Vector, u: Vector, v: Vector, w: Vector) -> float:
    """The squared distance (m²) from the origin to the farthest corner `middle` ± u ± v ± w."""
    farthest_2 = 0.0
    for sign_u in (-1.0, 1.0):
        for sign_v in (-1.0, 1.0):
            for sign_w in (-1.0, 1.0):
                corner = add(add(middle, scale(sign_u, u)), add(scale(sign_v, v), scale(sign_w, w)))
                farthest_2 = max(farthest_2, dot(corner, corner))
    return farthest_2


@building_block
def _opposite_faces(
    middle: Vector,
    across: Vector,
    half_edges: tuple[Vector, Vector],
    directions: tuple[Vector, Vector],
    normal: Vector,
    heights: tuple[float, float],
    area_2: float,
    radius: float,
) -> tuple[float, float, float, bool]:
    """(Σ h·A, Σ A·n along `normal`, Σ S, reached) of the faces at `middle` ± `across`.

    The second face is worked out as the first one of the box mirrored in the sphere's centre. `area_2` is
    twice the area of either.
    """
    plane, mirrored_plane = (normal, heights[0], area_2), (normal, heights[1], area_2)
    front, mirrored = add(across, middle), subtract(across, middle)
    disc, covered, reached = parallelogram_face(front, half_edges, directions, plane, radius)
    disc_2, covered_2, reached_2 = parallelogram_face(mirrored, half_edges, directions, mirrored_plane, radius)
    return heights[0] * disc + heights[1] * disc_2, disc - disc_2, covered + covered_2, reached or reached_2
