"""Lanes of triangles whose geometry plain arithmetic rounds too much, worked out in double-double arithmetic.

Two kinds need it: triangles that are large beside the ball, whose far corners have rounding errors that matter near
the centre, and all triangles of a tiny overlap, which depends on the small differences 1 - |h| and 1 - b².
"""

import math

from common.arrays import FloatArray
from robot_side.overlap.compile import building_block, inlined
from robot_side.overlap.double_double import DoubleDouble, divided, minus, multiple, plus, times, two_product
from robot_side.overlap.double_double_vectors import (
    PreciseVector,
    highs,
    precise_cross,
    precise_dot,
    precise_scale,
    precise_subtract,
)
from robot_side.overlap.mesh_tables import MeshTables
from robot_side.overlap.triangle_lanes import (
    BASES,
    CHORDS,
    CORNER_DISTANCES,
    DISTANCES,
    ENDS,
    GAP,
    HEIGHT,
    HEIGHTS,
    LANES,
    STARTS,
    across,
)
from robot_side.overlap.vectors import Vector, cross, dot, norm, scale

FAR = 3.0
"""An edge with both ends more than this many radii away is worked out again."""
_VANISHED = 1e-28


@inlined
def _precise(vector: Vector) -> PreciseVector:
    return (vector[0], 0.0), (vector[1], 0.0), (vector[2], 0.0)


@building_block
def refine_lane(
    scratch: FloatArray,
    lane: int,
    tables: MeshTables,
    triangle: int,
    center: PreciseVector,
    radius: float,
    every_edge: bool,
) -> None:
    """Work out `HEIGHTS` to `BASES` and `HEIGHT` of a lane again, and `GAP` and `CHORDS`.

    Without `every_edge` only for edges that are far at both ends, and the height if no edge is near.
    """
    row = tables.triangles[triangle]
    corners = (
        precise_subtract(_precise((row[0], row[1], row[2])), center),
        precise_subtract(_precise((row[3], row[4], row[5])), center),
        precise_subtract(_precise((row[6], row[7], row[8])), center),
    )
    normal = row[9], row[10], row[11]
    radius_2 = two_product(radius, radius)
    closest = math.inf
    for edge in range(3):
        start, end = corners[edge], corners[(edge + 1) % 3]
        start_first = _rank(highs(start)) < _rank(highs(end))
        near = start if start_first else end
        if every_edge or dot(highs(near), highs(near)) > FAR * FAR * radius * radius:
            along = precise_subtract(end, start)
            foot = precise_subtract(
                near, precise_scale(divided(precise_dot(along, near), precise_dot(along, along)), along)
            )
            direction = scale(row[12 + edge], highs(along))
            place = _not_vanished(highs(foot), _VANISHED * norm(highs(near)), direction)
            place = scale(1.0 / radius, place)
            scratch[HEIGHTS + edge * LANES + lane] = dot(normal, place)
            scratch[DISTANCES + edge * LANES + lane] = dot(cross(direction, normal), place)
            scratch[BASES + edge * LANES + lane] = norm(place)
            scratch[CHORDS + edge * LANES + lane] = divided(minus(radius_2, precise_dot(foot, foot)), radius_2)[0]
        if scratch[BASES + edge * LANES + lane] < closest:
            closest = scratch[BASES + edge * LANES + lane]
            scratch[HEIGHT + lane] = scratch[HEIGHTS + edge * LANES + lane]
    if every_edge or closest >= 1.0:
        _refine_height(scratch, lane, corners, radius_2, radius)


@building_block
def _refine_height(
    scratch: FloatArray,
    lane: int,
    corners: tuple[PreciseVector, PreciseVector, PreciseVector],
    radius_2: DoubleDouble,
    radius: float,
) -> None:
    """Work out `HEIGHT` and `GAP` of a lane from the triangle's plane."""
    crossed = precise_cross(precise_subtract(corners[1], corners[0]), precise_subtract(corners[2], corners[0]))
    size_2 = precise_dot(crossed, crossed)
    if size_2[0] <= 0.0:
        scratch[GAP + lane] = 0.0
        return
    product = precise_dot(crossed, corners[0])
    height = product[0] / (math.sqrt(size_2[0]) * radius)
    scale_2 = times(radius_2, size_2)
    scratch[HEIGHT + lane] = height
    scratch[GAP + lane] = divided(minus(scale_2, times(product, product)), scale_2)[0] / (1.0 + abs(height))


@inlined
def _rank(corner: Vector) -> float:
    """Nearness, by which an edge's first end is chosen: alike for the edge reversed."""
    return dot(corner, corner) * (1.0 + 1e-9 * math.tanh(corner[0] + 0.73 * corner[1] + 0.29 * corner[2]))


@inlined
def _not_vanished(foot: Vector, least: float, direction: Vector) -> Vector:
    """`foot`, or where the edge passes through the centre some vector across it, alike for the edge reversed."""
    if norm(foot) > least:
        return foot
    return scale(least, across(direction))


@building_block
def small_overlap(scratch: FloatArray, count: int) -> tuple[bool, float, float]:
    """(whether it applies, volume, covered solid angle) of `count` lanes with refined geometry; the radius is 1.

    For a centre outside, at some distance from every face that the ball reaches. The overlap is then
    - Σ (R³ Ω - h A) / 3 alone, in which every term is about as small as the overlap itself.
    """
    volume, covered = 0.0, 0.0
    for lane in range(count):
        height, gap = scratch[HEIGHT + lane], scratch[GAP + lane]
        depth = abs(height)
        if gap <= 0.0:
            continue
        foot_inside, reached = True, False
        straight, angle, turn = 0.0, 0.0, 0.0
        for edge in range(3):
            distance, base = scratch[DISTANCES + edge * LANES + lane], scratch[BASES + edge * LANES + lane]
            chord = scratch[CHORDS + edge * LANES + lane]
            half_chord = math.sqrt(chord) if chord > 0.0 else 0.0
            foot_inside = foot_inside and distance > 0.0
            start, end = scratch[STARTS + edge * LANES + lane], scratch[ENDS + edge * LANES + lane]
            away = scratch[CORNER_DISTANCES + edge * LANES + lane]
            other_away = scratch[CORNER_DISTANCES + (edge + 1) % 3 * LANES + lane]
            first, last = min(max(start, -half_chord), half_chord), min(max(end, -half_chord), half_chord)
            turn += math.atan2(distance * (end - last), distance * distance + end * last)
            turn -= math.atan2(distance * (start - first), distance * distance + start * first)
            if first == last:
                continue
            reached = True
            straight += distance * (last - first)
            angle += _seen(depth, distance, base, last, min(other_away, 1.0))
            angle -= _seen(depth, distance, base, first, min(away, 1.0))
        if not (foot_inside or reached):
            continue
        if depth < 0.5:
            return False, 0.0, 0.0
        sign = -1.0 if height > 0.0 else 1.0
        covered += sign * (angle + gap * turn)
        volume += sign * ((2.0 * angle - depth * straight) + turn * gap * gap * (2.0 + depth)) / 6.0
    return True, volume, covered


@inlined
def _seen(depth: float, distance: float, base: float, along: float, away: float) -> float:
    """The solid angle of the triangle (face's foot, edge's foot, edge's end at `along`)."""
    return 2.0 * math.atan2(distance * along, (base + depth) * (base + away))


@inlined
def precise_product(a: Vector, b: PreciseVector) -> DoubleDouble:
    """The scalar product of a vector of floats with a precise one."""
    first, second, third = multiple(a[0], b[0]), multiple(a[1], b[1]), multiple(a[2], b[2])
    return plus(plus(first, second), third)
