"""One sphere and one tetrahedron (eq. 11)."""

from robot_side.overlap.compile import building_block, inlined
from robot_side.overlap.faces import triangle_face, triangle_plane
from robot_side.overlap.solid import Overlap, bounded, from_faces, nothing, untouched, whole_solid, whole_sphere
from robot_side.overlap.vectors import Vector, add, cross, dot, negative, scale, subtract, unit

Corners = tuple[Vector, Vector, Vector, Vector]


@inlined
def tetrahedron_overlap(center: Vector, radius: float, corners: Corners) -> Overlap:
    """The overlap of the sphere (`center`, `radius`) with the tetrahedron of `corners`, all in m.

    The corners may come in any order. Without volume, or with a radius of 0, everything returned is 0.
    Finite input and a radius >= 0 are taken for granted.
    """
    overlap, solid_volume = tetrahedron_sum(center, radius, corners)
    return bounded(overlap, radius, solid_volume)


@building_block
def tetrahedron_sum(center: Vector, radius: float, corners: Corners) -> tuple[Overlap, float]:
    """The overlap before its bounds are applied, and the tetrahedron's volume (m³, 0 where not needed)."""
    if _bounding_box_distance_2(center, corners) >= radius * radius:
        return nothing(), 0.0
    first, second, third, fourth = corners
    volume_6 = dot(subtract(second, first), cross(subtract(third, first), subtract(fourth, first)))
    if volume_6 == 0.0:
        return nothing(), 0.0
    if volume_6 < 0.0:
        third, fourth = fourth, third
        volume_6 = -volume_6
    solid_volume = volume_6 / 6.0

    a, b = subtract(first, center), subtract(second, center)
    c, d = subtract(third, center), subtract(fourth, center)
    if max(dot(a, a), dot(b, b), dot(c, c), dot(d, d)) <= radius * radius:
        return whole_solid(solid_volume), solid_volume

    # From the corners as given: differences of a, b, c, d would carry the rounding of their distance to the
    # centre, which is large beside a tetrahedron that is small beside the sphere.
    ab, ac, ad = subtract(second, first), subtract(third, first), subtract(fourth, first)
    bc, bd, cd = subtract(third, second), subtract(fourth, second), subtract(fourth, third)
    plane_a = triangle_plane((b, c, d), (bc, cd, negative(bd)))
    plane_b = triangle_plane((a, d, c), (ad, negative(cd), negative(ac)))
    plane_c = triangle_plane((a, b, d), (ab, bd, negative(ad)))
    plane_d = triangle_plane((a, c, b), (ac, negative(bc), negative(ab)))
    lowest = min(plane_a[1], plane_b[1], plane_c[1], plane_d[1])
    if lowest <= -radius:
        return nothing(), 0.0
    if lowest >= radius:
        return whole_sphere(radius), solid_volume

    ab, ac, ad, bc, bd, cd = unit(ab), unit(ac), unit(ad), unit(bc), unit(bd), unit(cd)
    disc_a, covered_a, reached_a = triangle_face((b, c, d), (bc, cd, negative(bd)), plane_a, radius)
    disc_b, covered_b, reached_b = triangle_face((a, d, c), (ad, negative(cd), negative(ac)), plane_b, radius)
    disc_c, covered_c, reached_c = triangle_face((a, b, d), (ab, bd, negative(ad)), plane_c, radius)
    disc_d, covered_d, reached_d = triangle_face((a, c, b), (ac, negative(bc), negative(ab)), plane_d, radius)
    if not (reached_a or reached_b or reached_c or reached_d):
        return untouched(lowest, radius), solid_volume
    moment = disc_a * plane_a[1] + disc_b * plane_b[1] + disc_c * plane_c[1] + disc_d * plane_d[1]
    push = add(
        add(scale(disc_a, plane_a[0]), scale(disc_b, plane_b[0])),
        add(scale(disc_c, plane_c[0]), scale(disc_d, plane_d[0])),
    )
    covered = covered_a + covered_b + covered_c + covered_d
    return from_faces(moment, push, covered, radius), solid_volume


@inlined
def _bounding_box_distance_2(point: Vector, corners: Corners) -> float:
    """The squared distance (m²) from `point` to the corners' axis-aligned bounding box."""
    a, b, c, d = corners
    total = 0.0
    for axis in range(3):
        low = min(a[axis], b[axis], c[axis], d[axis])
        high = max(a[axis], b[axis], c[axis], d[axis])
        gap = max(low - point[axis], point[axis] - high, 0.0)
        total += gap * gap
    return total
