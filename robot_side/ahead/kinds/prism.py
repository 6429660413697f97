"""How much of a ball lies in a prism without ends: what passes through a triangle that it is moved across."""

import math

from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector

Flat = tuple[float, float]
"""A point across the prism, from the ball's centre."""


@inlined
def _beyond(place: float, half_chord: float, distance: float, radius: float) -> float:
    """∫ (r² - ρ²)^(3/2) dφ along a line at `distance` from the centre, from its foot point to `place` on it."""
    squared = half_chord * half_chord - place * place
    rest = math.sqrt(max(squared, 0.0))
    turn: float = radius**3 * math.atan2(radius * place, distance * rest)
    arc = math.asin(min(max(place / half_chord, -1.0), 1.0))
    return turn - distance * ((radius * radius + 0.5 * half_chord * half_chord) * arc + 0.5 * place * rest)


@building_block
def _beside(start: Flat, end: Flat, radius: float) -> float:
    """The ball's part in the prism over (centre, start, end), by its sign: 2/3 ∫ (r³ - (r² - ρ²)^(3/2)) dφ."""
    x, y = end[0] - start[0], end[1] - start[1]
    length = math.sqrt(x * x + y * y)
    turned = start[0] * end[1] - start[1] * end[0]
    if turned == 0.0 or length == 0.0:
        return 0.0
    distance = abs(turned) / length
    first, last = (start[0] * x + start[1] * y) / length, (end[0] * x + end[1] * y) / length
    part = radius**3 * math.atan2(distance * (last - first), distance * distance + first * last)
    if distance < radius:
        half_chord = math.sqrt((radius - distance) * (radius + distance))
        low, high = max(first, -half_chord), min(last, half_chord)
        if low < high:
            part -= _beyond(high, half_chord, distance, radius) - _beyond(low, half_chord, distance, radius)
    return math.copysign(2.0 / 3.0 * part, turned)


@inlined
def _flat(point: Vector) -> Flat:
    return point[0], point[1]


@building_block
def ball_in_prism(a: Vector, b: Vector, c: Vector, radius: float) -> float:
    """The volume (m³) that a ball about the origin has in common with an endless prism along z.

    The prism is that over the part of the triangle abc (m) with z >= -radius, which the ball has not passed yet.
    """
    total, corners = 0.0, 0
    first, last = (0.0, 0.0), (0.0, 0.0)
    for side in range(3):
        start, end = (a if side == 0 else b if side == 1 else c), (b if side == 0 else c if side == 1 else a)
        above, end_above = start[2] + radius, end[2] + radius
        for crossing in range(2):
            if crossing == 0 and above >= 0.0:
                corner = _flat(start)
            elif crossing == 1 and above * end_above < 0.0:
                share = above / (above - end_above)
                corner = start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
            else:
                continue
            if corners == 0:
                first = corner
            else:
                total += _beside(last, corner, radius)
            last = corner
            corners += 1
    return abs(total + _beside(last, first, radius))
