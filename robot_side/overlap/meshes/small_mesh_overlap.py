"""Tiny overlaps of a mesh and a sphere whose centre lies outside, in double-double arithmetic.

The sum of `triangle_lanes` is then a small difference from 4π, with the rounding errors of the whole 4π. As the centre
lies outside, 4π is not needed and the volume is -Σ (R³ Ω - h A) / 3. Each face's term is the part of the ball beyond
the face. These terms are small if the overlap is small. But an overlap with an edge or corner is far smaller than the
terms, so they are computed with 31 digits.
"""

from robot_side.compiled.kernel import building_block, inlined
from robot_side.overlap.digits.double_double import (
    PI,
    ZERO,
    DoubleDouble,
    divided,
    is_less,
    minus,
    multiple,
    negated,
    plus,
    square_root,
    times,
)
from robot_side.overlap.digits.double_double_vectors import (
    PreciseVector,
    precise_cross,
    precise_dot,
    precise_scale,
    precise_subtract,
    precise_unit,
)
from robot_side.overlap.digits.precise_arctangent import arctangent
from robot_side.overlap.meshes.large_triangles import PreciseTriangle

_ONE: DoubleDouble = (1.0, 0.0)

BeyondFace = tuple[DoubleDouble, DoubleDouble, PreciseVector]
"""Part of the ball beyond a face: (volume, solid angle, area of the face in the ball times its normal), for radius 1"""


@building_block
def beyond_face(corners: PreciseTriangle) -> BeyondFace:
    """Return the part of the unit ball that lies beyond a triangle, as seen from the centre.

    Volume and solid angle are positive if the solid's inside is beyond the triangle, else negative. `corners` are
    relative to the centre, in radii.
    """
    normal, size = precise_unit(
        precise_cross(precise_subtract(corners[1], corners[0]), precise_subtract(corners[2], corners[0]))
    )
    nothing = ZERO, ZERO, ZERO
    height = precise_dot(normal, corners[0])
    depth = negated(height) if height[0] < 0.0 else height
    gap = minus(_ONE, depth)
    if size[0] == 0.0 or gap[0] <= 0.0:
        return ZERO, ZERO, nothing
    foot_inside, reached = True, False
    straight, seen, turn = ZERO, ZERO, ZERO
    for edge in range(3):
        start, end = corners[edge], corners[(edge + 1) % 3]
        along, _ = precise_unit(precise_subtract(end, start))
        first, last = precise_dot(start, along), precise_dot(end, along)
        distance = precise_dot(start, precise_cross(along, normal))
        foot_inside = foot_inside and distance[0] > 0.0
        base_2 = plus(times(depth, depth), times(distance, distance))
        half_chord = square_root(minus(_ONE, base_2))
        enter, leave = _clipped(first, half_chord), _clipped(last, half_chord)
        turn = plus(turn, minus(_angle(distance, leave, last), _angle(distance, enter, first)))
        length = minus(leave, enter)
        if length[0] > 0.0:
            reached = True
            straight = plus(straight, times(distance, length))
            base = square_root(base_2)
            seen = plus(seen, minus(_seen(depth, distance, base, leave), _seen(depth, distance, base, enter)))
    if not (foot_inside or reached):
        return ZERO, ZERO, nothing
    if not reached:
        turn = multiple(2.0, PI)
    solid_angle = plus(seen, times(gap, turn))
    cap = times(times(turn, plus((2.0, 0.0), depth)), times(gap, gap))
    volume = divided(plus(minus(multiple(2.0, seen), times(depth, straight)), cap), (6.0, 0.0))
    area = multiple(0.5, plus(straight, times(times(gap, plus(_ONE, depth)), turn)))
    if height[0] > 0.0:
        volume, solid_angle = negated(volume), negated(solid_angle)
    return volume, solid_angle, precise_scale(area, normal)


@inlined
def _clipped(along: DoubleDouble, half_chord: DoubleDouble) -> DoubleDouble:
    if is_less(half_chord, along):
        return half_chord
    return negated(half_chord) if is_less(along, negated(half_chord)) else along


@building_block
def _angle(distance: DoubleDouble, start: DoubleDouble, end: DoubleDouble) -> DoubleDouble:
    """Return the angle, seen from the face's foot point, between two points of an edge.

    `start`, `end`: their positions along the edge from the edge's own foot point. `distance`: that of the edge's line.
    """
    return arctangent(times(distance, minus(end, start)), plus(times(distance, distance), times(start, end)))


@building_block
def _seen(depth: DoubleDouble, distance: DoubleDouble, base: DoubleDouble, along: DoubleDouble) -> DoubleDouble:
    """Return the solid angle of the triangle (face's foot, edge's foot, edge's end at `along`)."""
    away = square_root(plus(times(base, base), times(along, along)))
    return multiple(2.0, arctangent(times(distance, along), times(plus(base, depth), plus(base, away))))
