"""Ball ∩ orthoscheme: the one curved shape from which every overlap with flat faces is summed.

An orthoscheme with legs h, d, t is the tetrahedron with vertices (0,0,0), (h,0,0), (h,d,0) and (h,d,t). Put
the sphere's centre at its first vertex. Going round a closed surface, each face lies at a signed distance h,
each edge at a signed distance d within the face, each edge's end at a signed distance t along the edge, and
the overlap is the sum of G(h, d, t), odd in each leg, over edge ends minus edge starts. No decision about
topology is taken, so rounding cannot flip one: the sum is continuous in all of its inputs.

By the divergence theorem, with the origin at the sphere's centre,

    G(h, d, t) = (h · A + R · S) / 3

where A is the area of the orthoscheme's flat far side (at distance h) inside the ball and S that part of the
sphere's surface within the orthoscheme. A and S are also what the gradient of the overlap is made of.
"""

import math

from robot_side.overlap.compile import inlined


@inlined
def orthoscheme(height: float, distance: float, along: float, radius: float) -> tuple[float, float, float]:
    """Ball ∩ orthoscheme as (triangle, plane_angle, solid_angle), each odd in `distance` and `along`.

    `height` >= 0 is |h|; `distance` and `along` are the signed d and t; lengths in m. With
    `face_areas` the three give A and S:

    - triangle (m²): the part of A that straight lines bound;
    - plane_angle (rad): the angle of the disc's sector that bounds the rest of A;
    - solid_angle (sr): of the far side's part that lies beyond the straight-bounded triangle.
    """
    radius_2 = radius * radius
    base_2 = height * height + distance * distance
    slant_2 = base_2 + along * along
    product = distance * along
    if product == 0.0:
        return 0.0, 0.0, 0.0
    if slant_2 <= radius_2:
        return 0.5 * product, 0.0, 0.0

    slant = math.sqrt(slant_2)
    sine, cosine = _solid_angle_terms(height, distance, along, slant)
    if height >= radius:
        return 0.0, 0.0, math.atan2(sine, cosine)
    if base_2 >= radius_2:
        return 0.0, math.atan2(product, distance * distance), math.atan2(sine, cosine)

    # The far edge leaves the ball at `exit_along`: up to there the ball holds the whole orthoscheme. An error
    # in `exit_along`, which rounding makes large when the edge is nearly tangent, has no effect to first order.
    exit_along = math.copysign(math.sqrt(radius_2 - base_2), along)
    exit_sine, exit_cosine = _solid_angle_terms(height, distance, exit_along, radius)
    return (
        0.5 * distance * exit_along,
        math.atan2(distance * (along - exit_along), distance * distance + along * exit_along),
        math.atan2(sine * exit_cosine - cosine * exit_sine, cosine * exit_cosine + sine * exit_sine),
    )


@inlined
def _solid_angle_terms(height: float, distance: float, along: float, slant: float) -> tuple[float, float]:
    """Sine and cosine, times a common factor, of the solid angle of the orthoscheme at its first vertex."""
    square = distance * distance
    # slant - height, written without its cancellation
    rise = (square + along * along) / (slant + height)
    return distance * along * rise, square * slant + height * along * along


@inlined
def face_areas(
    height: float, triangle: float, plane_angle: float, solid_angle: float, radius: float
) -> tuple[float, float]:
    """(A, S) in m² of a face at the signed distance `height` from the sums of its orthoschemes' terms.

    A, the area of the face inside the ball, is even in `height`; S, the area of the sphere's surface that the
    face covers as seen from the centre, is odd. `plane_angle` is 0 for a face beyond the ball.
    """
    gap = radius - abs(height)
    disc = triangle + 0.5 * gap * (radius + abs(height)) * plane_angle
    covered = radius * (radius * solid_angle - gap * plane_angle)
    if height > 0.0:
        return disc, covered
    if height < 0.0:
        return disc, -covered
    return disc, 0.0
