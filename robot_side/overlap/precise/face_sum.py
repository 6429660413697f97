"""Overlap of a sphere with a polyhedron in double-double, as a sum over the faces.

The sum is that of `face_angles`, arranged so that few arctangents are needed. Where the ball reaches a face, the parts
of the face's sides outside the ball form triangles with the face's foot point. The solid angles of these triangles all
have the same weight in the volume. So they are summed over the whole solid, as a product of complex numbers; their
angles about the foot point are summed in this way over the face. A face that the ball does not reach adds its own solid
angle. All solid angles are van Oosterom's and Strackee's (1983), whose complex number has half of the solid angle. Of
the sides' parts inside the ball only the lengths are needed. As in `face_angles`, the result is continuous wherever
rounding moves the point at which a side enters or leaves the ball.
"""

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import negative
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
    rounded,
    times,
)
from robot_side.overlap.digits.double_double_vectors import (
    highs,
    load_number,
    load_vector,
    precise_add,
    precise_dot,
    precise_scale,
)
from robot_side.overlap.digits.precise_arctangent import NO_TURN, Turn, turned, whole_angle
from robot_side.overlap.precise.features import (
    BASES,
    EDGE_ENDS,
    ENDS,
    FACE_CORNERS,
    FACE_EDGES,
    FACE_SIGNS,
    FACES,
    HALF_CHORDS,
    HEIGHTS,
    LENGTHS,
    MOMENTS,
    NORMALS,
    POINTS,
    REACHED,
    SIDES,
    STARTS,
    distance_in_face,
)
from robot_side.overlap.solids.solid import Overlap


@building_block
def sum_over_faces(features: FloatArray, solid: np.int64, radius: float) -> Overlap:
    """Return the overlap with the solid whose measures are in `features`, without bounds; `measure_all` fills these."""
    ball = (radius, 0.0)
    radius_2 = times(ball, ball)
    solid_angle = NO_TURN
    moment, arcs = ZERO, ZERO
    push = ZERO, ZERO, ZERO
    for face in range(FACES[solid]):
        height = load_number(features, HEIGHTS + face)
        below = height[0] < 0.0 or (height[0] == 0.0 and height[1] < 0.0)
        depth = negated(height) if below else height
        sides = SIDES[solid]
        face_reached, side_reached = _is_reached(features, solid, face, is_less(depth, ball))
        if not face_reached:
            solid_angle = _whole_face(features, solid, face, solid_angle)
            continue
        plane_angle, triangle = NO_TURN, ZERO
        for side in range(sides):
            edge, sign = FACE_EDGES[solid, face, side], FACE_SIGNS[solid, face, side]
            distance = distance_in_face(features, solid, face, side)
            first, last = (0, 1) if sign > 0 else (1, 0)
            start, end = (
                load_number(features, (STARTS if sign > 0 else ENDS) + edge),
                load_number(features, (ENDS if sign > 0 else STARTS) + edge),
            )
            start_slant = load_number(features, LENGTHS + EDGE_ENDS[solid, edge, first])
            end_slant = load_number(features, LENGTHS + EDGE_ENDS[solid, edge, last])
            if sign < 0:
                start, end = negated(start), negated(end)
            base_2 = load_number(features, BASES + edge)
            frame = depth, distance, times(distance, distance), base_2, below
            if features[REACHED + edge, 0, 0] == 0.0:
                plane_angle, solid_angle = _outside(
                    frame, (start, start_slant), (end, end_slant), plane_angle, solid_angle
                )
                continue
            half_chord = load_number(features, HALF_CHORDS + edge)
            enter, leave = negated(half_chord), half_chord
            if is_less(start, enter):
                plane_angle, solid_angle = _outside(
                    frame, (start, start_slant), (enter, ball), plane_angle, solid_angle
                )
            else:
                enter = start
            if is_less(leave, end):
                plane_angle, solid_angle = _outside(frame, (leave, ball), (end, end_slant), plane_angle, solid_angle)
            else:
                leave = end
            triangle = plus(triangle, times(distance, minus(leave, enter)))
        angle = multiple(2.0, PI) if not side_reached else whole_angle(plane_angle)
        ring_2 = times(minus(ball, depth), plus(ball, depth))
        area = multiple(0.5, plus(triangle, times(ring_2, angle)))
        moment = plus(moment, times(height, area))
        arc = times(minus(ball, depth), angle)
        arcs = minus(arcs, arc) if below else plus(arcs, arc)
        push = precise_add(push, precise_scale(area, load_vector(features, NORMALS + face)))
    surface = minus(multiple(2.0, times(radius_2, whole_angle(solid_angle))), times(ball, arcs))
    volume = divided(plus(moment, times(ball, surface)), (3.0, 0.0))
    return rounded(volume), negative(highs(push)), rounded(surface)


@inlined
def _is_reached(features: FloatArray, solid: np.int64, face: int, plane_reached: bool) -> tuple[bool, bool]:
    """Return whether the ball reaches the face, and whether it reaches any of the face's sides.

    plane_reached: whether the ball reaches the face's plane.
    """
    foot_inside, side_reached = plane_reached, False
    if plane_reached:
        for side in range(SIDES[solid]):
            side_reached = side_reached or features[REACHED + FACE_EDGES[solid, face, side], 0, 0] > 0.0
            foot_inside = foot_inside and distance_in_face(features, solid, face, side)[0] > 0.0
    return foot_inside or side_reached, side_reached


Frame = tuple[DoubleDouble, DoubleDouble, DoubleDouble, DoubleDouble, bool]
"""Distances of one side of a face: (|h|, d, d², h² + d², whether h < 0); h is the face's height, d the side's distance
from the face's foot point"""


@building_block
def _outside(
    frame: Frame,
    start: tuple[DoubleDouble, DoubleDouble],
    end: tuple[DoubleDouble, DoubleDouble],
    plane_angle: Turn,
    solid_angle: Turn,
) -> tuple[Turn, Turn]:
    """Add the part of a side from `start` to `end` to the angle about the foot point and to the solid angle.

    Each point is (signed distance along the side from the line's foot point, distance from the sphere's centre).
    """
    depth, distance, distance_2, base_2, below = frame
    sine = times(distance, minus(end[0], start[0]))
    alongs = times(start[0], end[0])
    plane_angle = turned(plane_angle, plus(distance_2, alongs), sine)
    cosine = plus(times(start[1], end[1]), times(depth, plus(start[1], end[1])))
    cosine = plus(cosine, plus(base_2, alongs))
    return plane_angle, turned(solid_angle, cosine, negated(sine) if below else sine)


@building_block
def _whole_face(features: FloatArray, solid: np.int64, face: int, solid_angle: Turn) -> Turn:
    """Return `solid_angle` with the solid angle of a whole face added; the face must not contain the centre."""
    volume_6 = load_number(features, MOMENTS + face)
    a_corner = FACE_CORNERS[solid, face, 0]
    a, a_length = load_vector(features, POINTS + a_corner), load_number(features, LENGTHS + a_corner)
    for side in range(1, SIDES[solid] - 1):
        b_corner, c_corner = FACE_CORNERS[solid, face, side], FACE_CORNERS[solid, face, side + 1]
        b, b_length = load_vector(features, POINTS + b_corner), load_number(features, LENGTHS + b_corner)
        c, c_length = load_vector(features, POINTS + c_corner), load_number(features, LENGTHS + c_corner)
        cosine = times(a_length, times(b_length, c_length))
        cosine = plus(cosine, times(precise_dot(a, b), c_length))
        cosine = plus(cosine, times(precise_dot(b, c), a_length))
        cosine = plus(cosine, times(precise_dot(c, a), b_length))
        solid_angle = turned(solid_angle, cosine, volume_6)
    return solid_angle
