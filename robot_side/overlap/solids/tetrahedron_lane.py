"""Overlap of a sphere and a tetrahedron, computed without a branch: one lane of the vectorised loop.

The loop is in `tetrahedron_batch`. Faces, edges and corners are measured from a reference point. This is a point of the
tetrahedron near the sphere's centre, given by its barycentric coordinates, the "shares" of the corners. A face's
distance from the reference point is the opposite corner's share times that corner's altitude. So short distances are
known to their last digit, even in a large tetrahedron.
"""

import math

from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, add, cross, dot, negative, norm, scale, subtract
from robot_side.overlap.digits.double_double import two_sum
from robot_side.overlap.digits.error_free import determinant, difference, sum_of_products
from robot_side.overlap.solids.face_angles import FaceSum, add_edge, edge_terms, face_areas, first_edge
from robot_side.overlap.solids.lane_result import LaneResult, settle
from robot_side.overlap.solids.solid import from_faces
from robot_side.overlap.solids.split_edge import SplitEdge, split_edge

Corners = tuple[Vector, Vector, Vector, Vector]
Shares = tuple[float, float, float, float]

PlacedEdge = tuple[Vector, Vector, SplitEdge, float, float, bool]
"""(unit direction, foot point of the line relative to the sphere's centre, the edge's split, its squared distance from
the centre, its length, whether the foot point lost digits)"""

LARGEST_CANCELLATION = 10.0
"""Size of a foot point's terms, divided by the larger of the radius and the foot point's distance from the centre,
beyond which the foot point has lost digits"""

SHARPEST_FACE = 20.0
"""Product of a triangle's two shortest sides, divided by the length of their cross product, beyond which the normal has
lost digits"""


@inlined
def tetrahedron_lane(center: Vector, radius: float, corners: Corners) -> LaneResult:
    """Return the overlap of the sphere (`center`, `radius`) with the tetrahedron of `corners`.

    The lengths are scaled so that the radius is 1 to 2. The overlap is exact to some 4e-16 of the sphere, unless the
    result is marked for precise forms.
    """
    first, second, third, fourth = corners
    a, a_rest = difference(first, center)
    b, c, d = subtract(second, center), subtract(third, center), subtract(fourth, center)
    ab, ab_rest = difference(second, first)
    ac, ac_rest = difference(third, first)
    ad, ad_rest = difference(fourth, first)
    bc, bd, cd = subtract(third, second), subtract(fourth, second), subtract(fourth, third)
    norm_a, norm_b, norm_c, norm_d = norm(a), norm(b), norm(c), norm(d)
    volume_6 = determinant(ab, ac, ad, ab_rest, ac_rest, ad_rest)
    inverse = 1.0 / (volume_6 if volume_6 != 0.0 else 1.0)

    across_a, across_b = _across(bc, cd, negative(bd)), _across(ad, negative(cd), negative(ac))
    across_c, across_d = _across(ab, bd, negative(ad)), _across(ac, negative(bc), negative(ab))
    per_area_a, per_area_b = _inverse_norm(across_a), _inverse_norm(across_b)
    per_area_c, per_area_d = _inverse_norm(across_c), _inverse_norm(across_d)
    normal_a, normal_b = scale(per_area_a, across_a), scale(per_area_b, across_b)
    normal_c, normal_d = scale(per_area_c, across_c), scale(per_area_d, across_d)
    shares = _shares(
        dot(b, across_a) * inverse, dot(a, across_b) * inverse, dot(a, across_c) * inverse, dot(a, across_d) * inverse
    )
    share_a, share_b, share_c, share_d = shares
    weights = share_b, share_c, share_d
    reference = (
        sum_of_products(a[0], a_rest[0], weights, (ab[0], ac[0], ad[0]), (ab_rest[0], ac_rest[0], ad_rest[0])),
        sum_of_products(a[1], a_rest[1], weights, (ab[1], ac[1], ad[1]), (ab_rest[1], ac_rest[1], ad_rest[1])),
        sum_of_products(a[2], a_rest[2], weights, (ab[2], ac[2], ad[2]), (ab_rest[2], ac_rest[2], ad_rest[2])),
    )
    # The altitude from a face to its opposite corner is 6 V / 2 A.
    height_a = dot(reference, normal_a) + share_a * (volume_6 * per_area_a)
    height_b = dot(reference, normal_b) + share_b * (volume_6 * per_area_b)
    height_c = dot(reference, normal_c) + share_c * (volume_6 * per_area_c)
    height_d = dot(reference, normal_d) + share_d * (volume_6 * per_area_d)

    radius_2 = radius * radius
    imprecise = (
        _is_sharp((bc, cd, bd), across_a, height_a, radius_2)
        | _is_sharp((ad, cd, ac), across_b, height_b, radius_2)
        | _is_sharp((ab, bd, ad), across_c, height_c, radius_2)
        | _is_sharp((ac, bc, ab), across_d, height_d, radius_2)
    )
    edge_ab = _edge(
        reference, ab, negative(ac), negative(ad), (share_a, share_b, share_c, share_d), norm_a, norm_b, radius
    )
    edge_ac = _edge(
        reference, ac, negative(ab), negative(ad), (share_a, share_c, share_b, share_d), norm_a, norm_c, radius
    )
    edge_ad = _edge(
        reference, ad, negative(ab), negative(ac), (share_a, share_d, share_b, share_c), norm_a, norm_d, radius
    )
    edge_bc = _edge(reference, bc, ab, negative(bd), (share_b, share_c, share_a, share_d), norm_b, norm_c, radius)
    edge_bd = _edge(reference, bd, ab, negative(bc), (share_b, share_d, share_a, share_c), norm_b, norm_d, radius)
    edge_cd = _edge(reference, cd, ac, bc, (share_c, share_d, share_a, share_b), norm_c, norm_d, radius)

    imprecise |= edge_ab[5] | edge_ac[5] | edge_ad[5] | edge_bc[5] | edge_bd[5] | edge_cd[5]
    face_a = _face((edge_bc, edge_cd, edge_bd), (1.0, 1.0, -1.0), normal_a, height_a)
    face_b = _face((edge_ad, edge_cd, edge_ac), (1.0, -1.0, -1.0), normal_b, height_b)
    face_c = _face((edge_ab, edge_bd, edge_ad), (1.0, 1.0, -1.0), normal_c, height_c)
    face_d = _face((edge_ac, edge_bc, edge_ab), (1.0, -1.0, -1.0), normal_d, height_d)

    sense = 1.0 if volume_6 > 0.0 else -1.0
    lowest = min(sense * height_a, sense * height_b, sense * height_c, sense * height_d)
    nearest_2 = min(
        edge_ab[3],
        edge_ac[3],
        edge_ad[3],
        edge_bc[3],
        edge_bd[3],
        edge_cd[3],
        face_a[1],
        face_b[1],
        face_c[1],
        face_d[1],
    )
    farthest, extent = (
        max(norm_a, norm_b, norm_c, norm_d),
        max(edge_ab[4], edge_ac[4], edge_ad[4], edge_bc[4], edge_bd[4], edge_cd[4]),
    )
    disc_a, covered_a = face_areas(height_a, face_a[0], radius)
    disc_b, covered_b = face_areas(height_b, face_b[0], radius)
    disc_c, covered_c = face_areas(height_c, face_c[0], radius)
    disc_d, covered_d = face_areas(height_d, face_d[0], radius)
    moment = disc_a * height_a + disc_b * height_b + disc_c * height_c + disc_d * height_d
    push = add(
        add(scale(disc_a, normal_a), scale(disc_b, normal_b)), add(scale(disc_c, normal_c), scale(disc_d, normal_d))
    )
    # The normals of an inverted tetrahedron point inward, which flips every sign.
    overlap = from_faces(
        sense * moment, scale(sense, push), sense * (covered_a + covered_b + covered_c + covered_d), radius
    )
    sizes = dot(reference, reference), farthest, extent
    return settle(overlap, radius, abs(volume_6) / 6.0, nearest_2, lowest, *sizes, imprecise)


@inlined
def _across(ab: Vector, bc: Vector, ca: Vector) -> Vector:
    """Return the normal of the triangle with these edges, of twice the area's length.

    It is the cross product of the two shortest edges, which round least.
    """
    ab_2, bc_2, ca_2 = dot(ab, ab), dot(bc, bc), dot(ca, ca)
    ab_longest = (ab_2 >= bc_2) & (ab_2 >= ca_2)
    bc_longest = bc_2 >= ca_2
    return cross(
        _select(ab_longest, bc, _select(bc_longest, ca, ab)), _select(ab_longest, ca, _select(bc_longest, ab, bc))
    )


@inlined
def _is_sharp(edges: tuple[Vector, Vector, Vector], across: Vector, height: float, radius_2: float) -> bool:
    """Return whether a face's lost digits matter: its normal has lost digits, it is large, and the sphere cuts it."""
    first_2, second_2, third_2 = dot(edges[0], edges[0]), dot(edges[1], edges[1]), dot(edges[2], edges[2])
    shortest_4 = min(first_2 * second_2, first_2 * third_2, second_2 * third_2)
    cut = height * height < radius_2
    large = shortest_4 > 36.0 * (radius_2 * radius_2)
    return (shortest_4 > SHARPEST_FACE**2 * dot(across, across)) & cut & large


@inlined
def _inverse_norm(a: Vector) -> float:
    """Return 1/|a|; 1 for the vector 0, so that the scaled vector stays 0."""
    length_2 = dot(a, a)
    return 1.0 / math.sqrt(length_2 if length_2 > 0.0 else 1.0)


@inlined
def _select(condition: bool, yes: Vector, no: Vector) -> Vector:
    return yes[0] if condition else no[0], yes[1] if condition else no[1], yes[2] if condition else no[2]


@inlined
def _shares(first: float, second: float, third: float, fourth: float) -> Shares:
    """Return barycentric coordinates of the reference point, from those of the sphere's centre.

    They are cut to 0 to 1 and scaled; the first one is chosen so that their sum is exactly 1.
    """
    first, second = min(max(first, 0.0), 1.0), min(max(second, 0.0), 1.0)
    third, fourth = min(max(third, 0.0), 1.0), min(max(fourth, 0.0), 1.0)
    total = first + second + third + fourth
    factor = 1.0 / (total if total > 0.0 else 1.0)
    second, third, fourth = second * factor, third * factor, fourth * factor
    rest, rest_1 = two_sum(1.0, -second)
    rest, rest_2 = two_sum(rest, -third)
    rest, rest_3 = two_sum(rest, -fourth)
    return rest + (rest_1 + rest_2 + rest_3), second, third, fourth


@inlined
def _edge(
    reference: Vector,
    edge: Vector,
    from_third: Vector,
    from_fourth: Vector,
    shares: Shares,
    start_norm: float,
    end_norm: float,
    radius: float,
) -> PlacedEdge:
    """Return the measures of the edge from the start corner to the end corner.

    `edge`: end - start. `from_third`, `from_fourth`: start minus each of the two other corners. `shares`: those of
    (start, end, third, fourth).
    """
    inverse_length = _inverse_norm(edge)
    direction = scale(inverse_length, edge)
    length = dot(edge, direction)
    # start = reference + Σ share (start - corner); the end's term lies along the edge.
    aside = add(reference, add(scale(shares[2], from_third), scale(shares[3], from_fourth)))
    along = dot(aside, direction)
    foot = subtract(aside, scale(along, direction))
    start = along - shares[1] * length
    end = along + (shares[0] + (shares[2] + shares[3])) * length
    foot_2 = dot(foot, foot)
    nearest = min(max(0.0, start), end)
    split = split_edge(start, end, start_norm, end_norm, foot_2, radius)
    terms_2 = shares[2] * shares[2] * dot(from_third, from_third) + shares[3] * shares[3] * dot(
        from_fourth, from_fourth
    )
    imprecise = terms_2 > LARGEST_CANCELLATION**2 * max(radius * radius, foot_2)
    return direction, foot, split, foot_2 + nearest * nearest, length, imprecise


@inlined
def _face(
    edges: tuple[PlacedEdge, PlacedEdge, PlacedEdge], senses: Vector, normal: Vector, height: float
) -> tuple[FaceSum, float]:
    """Return (sum over the face's edges, the face's squared distance from the centre).

    The distance is that of the foot point if it lies within the face, else infinite: then an edge is nearest. senses: 1
    if the face runs along an edge, -1 if against it.
    """
    first, second, third = edges
    depth = abs(height)
    distance_1 = senses[0] * dot(first[1], cross(first[0], normal))
    distance_2 = senses[1] * dot(second[1], cross(second[0], normal))
    distance_3 = senses[2] * dot(third[1], cross(third[0], normal))
    total = first_edge(edge_terms(first[2], distance_1, depth))
    total = add_edge(total, edge_terms(second[2], distance_2, depth))
    total = add_edge(total, edge_terms(third[2], distance_3, depth))
    within = min(distance_1, distance_2, distance_3) > 0.0
    return total, depth * depth if within else math.inf
