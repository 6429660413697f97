"""How much of a ball lies in a prism without ends: what passes through a triangle that it is moved across."""

import math

from robot_side.compiled.kernel import building_block, inlined

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


@building_block
def ball_in_prism(a: Flat, b: Flat, c: Flat, radius: float) -> float:
    """The volume (m³) that a ball about the origin has in common with the endless prism over the triangle abc (m)."""
    return abs(_beside(a, b, radius) + _beside(b, c, radius) + _beside(c, a, radius))
