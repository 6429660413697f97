"""One oracle: true overlaps to 30 digits or more, for the doubles exactly as they are.

Solids with flat faces: the sum of signed orthoschemes over every edge of every face, with the sphere's centre as
the origin, in 60 decimal digits, and in twice as many again while cancellation leaves fewer than 30 of them.
Whether there is an overlap at all is decided in whole numbers beforehand, so that a truth of 0 is exact. For a
face at the signed distance h from the centre, with an edge at the signed distance d from the face's foot point
and an end of it at t from the edge's, the terms that the ball of radius R has in common with the orthoscheme are,
with b² = h² + d², c² = b² + t², φ = atan2(t, d) and Ω the solid angle at the centre,

    area on the face:  d t/2 (c <= R);  0 (h >= R);  (R² - h²) φ/2 (b >= R);  d t'/2 + (R² - h²)(φ - φ')/2 else
    area on the sphere:  0 (c <= R);  R² Ω (h >= R);  R² (Ω - φ (1 - h/R)) (b >= R);
        R² (Ω - Ω' - (φ - φ')(1 - h/R)) else

odd in d and t, the latter odd in h, where the primes belong to t'² = R² - b². The volume is Σ (h A + R S)/3, by
the divergence theorem. Half-spaces and spheres have closed forms.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpmath import MPContext

from common.arrays import FloatArray, IntArray
from feelahead.lab.reference.contact import Point, cross, dot, exact_contact, exact_corners, minus
from feelahead.lab.reference.pairs import BOX_QUADRILATERALS, TETRAHEDRON_TRIANGLES, Pairs

DIGITS = 60
"""Decimal digits of the first attempt."""
GOOD_DIGITS = 30
"""Decimal digits that cancellation must leave."""
_MOST_DIGITS = 2000
_MOST_DIGITS_OF_MESHES = 120
"""Share of the sphere's volume below which a mesh's overlap cannot be told from none: contact is not decided before."""

Number = Any
"""Number of mpmath; the library is untyped."""
Face = Sequence[int]


@dataclass(frozen=True)
class Truth:
    """Volume (m³), dV/dcentre (m²) and dV/dradius (m²) as mpmath numbers, and the number of faces cut by the ball."""

    volume: Number
    gradient: Point
    area: Number
    faces_cut: int = 0

    def volume_error(self, volume: float) -> float:
        """Return |`volume` - truth| in m³, without rounding of the truth; infinite for NaN."""
        return float(abs(self.volume - volume)) if np.isfinite(volume) else float("inf")

    def gradient_error(self, gradient: FloatArray) -> float:
        """Return |`gradient` (3,) - truth| in m²; infinite for NaN."""
        apart = [float(abs(g - t)) for g, t in zip(gradient.tolist(), self.gradient, strict=True)]
        return float(np.linalg.norm(apart)) if np.isfinite(gradient).all() else float("inf")

    def area_error(self, area: float) -> float:
        """Return |`area` - truth| in m²; infinite for NaN."""
        return float(abs(self.area - area)) if np.isfinite(area) else float("inf")

    def direction_error(self, gradient: FloatArray) -> float:
        """Return the sine of the angle between `gradient` (3,) and the true one, or 1 beyond a right angle."""
        lengths = [float(component) for component in self._unit_gradient()]
        given = gradient / np.linalg.norm(gradient) if np.any(gradient) else np.zeros(3)
        sine = float(np.linalg.norm(np.cross(given, lengths)))
        return sine if float(np.dot(given, lengths)) > 0.0 else 1.0

    def _unit_gradient(self) -> Point:
        length = sum(component**2 for component in self.gradient) ** 0.5
        if length == 0:
            return self.gradient
        x, y, z = (component / length for component in self.gradient)
        return x, y, z


def true_overlaps(pairs: Pairs) -> list[Truth]:
    """Return the truth of each pair."""
    return [true_overlap(pairs, row) for row in range(len(pairs))]


def true_overlap(pairs: Pairs, row: int) -> Truth:
    """Return the truth of one pair."""
    mp = _context(DIGITS)
    zero = mp.mpf(0)
    if not exact_contact(pairs, row):
        return Truth(zero, (zero, zero, zero), zero)
    center, radius = pairs.centers[row], float(pairs.radii[row])
    if pairs.solid == "half-space":
        return _half_space(mp, center, radius, pairs.parameters[0][row], float(pairs.parameters[1][row]))
    if pairs.solid == "sphere":
        return _sphere(mp, center, radius, pairs.parameters[0][row], float(pairs.parameters[1][row]))
    faces: Sequence[Face] = TETRAHEDRON_TRIANGLES if pairs.solid == "tetrahedron" else BOX_QUADRILATERALS
    corners = exact_corners(pairs, row)
    # An inverted solid gives a negative sum, whose sign is changed.
    return _with_enough_digits(corners, faces, center, radius)


def true_mesh_overlap(center: FloatArray, radius: float, vertices: FloatArray, triangles: IntArray) -> Truth:
    """Return the truth for a closed mesh: vertices (v, 3) in m, triangles (t, 3) oriented outward, convex or not."""
    return _with_enough_digits(vertices.tolist(), triangles.tolist(), center, radius, _MOST_DIGITS_OF_MESHES)


def _with_enough_digits(
    corners: Sequence[Sequence[Any]], faces: Sequence[Face], center: FloatArray, radius: float, most: int = _MOST_DIGITS
) -> Truth:
    digits = DIGITS
    while True:
        mp = _context(digits)
        total, magnitude = _face_sum(mp, corners, faces, center, radius)
        if abs(total.volume) > magnitude * mp.mpf(10) ** (GOOD_DIGITS - digits) or digits >= most:
            break
        digits *= 2
    sign = 1 if total.volume > 0 else -1
    x, y, z = (sign * component for component in total.gradient)
    return Truth(sign * total.volume, (x, y, z), sign * total.area, total.faces_cut)


def _face_sum(
    mp: Any, corners: Sequence[Sequence[Any]], faces: Sequence[Face], center: FloatArray, radius: float
) -> tuple[Truth, Number]:
    """Return the sum over all faces, and the sum of the terms' magnitudes."""
    origin = [mp.mpf(float(x)) for x in center]
    big_r = mp.mpf(radius)
    points = [_relative(mp, corner, origin) for corner in corners]
    volume = surface = magnitude = mp.mpf(0)
    gradient = (mp.mpf(0), mp.mpf(0), mp.mpf(0))
    cut = 0
    for face in faces:
        ring = [points[index] for index in face]
        normal = cross(minus(ring[1], ring[0]), minus(ring[2], ring[0]))
        size = _norm(mp, normal)
        if size == 0:
            continue
        normal = _scale(1 / size, normal)
        height = dot(normal, ring[0])
        disc = covered = mp.mpf(0)
        for start, end in zip(ring, (*ring[1:], ring[0]), strict=True):
            along = minus(end, start)
            along = _scale(1 / _norm(mp, along), along)
            distance = dot(start, cross(along, normal))
            for point, sign in ((end, 1), (start, -1)):
                on_face, on_sphere = _orthoscheme(mp, abs(height), distance, dot(point, along), big_r)
                disc += sign * on_face
                covered += sign * on_sphere
                magnitude += abs(height) * abs(on_face) + big_r * abs(on_sphere)
        covered *= mp.sign(height)
        volume += (height * disc + big_r * covered) / 3
        surface += covered
        gradient = minus(gradient, _scale(disc, normal))
        cut += bool(disc > mp.mpf(10) ** (GOOD_DIGITS - mp.dps) * big_r**2)
    return Truth(volume, gradient, surface, cut), magnitude


def _orthoscheme(mp: Any, height: Number, distance: Number, along: Number, radius: Number) -> tuple[Number, Number]:
    """Return (area on the face, area on the sphere), odd in `distance` and `along`; `height` >= 0."""
    sign = mp.sign(distance) * mp.sign(along)
    if sign == 0:
        return mp.mpf(0), mp.mpf(0)
    d, t = abs(distance), abs(along)
    base_2 = height**2 + d**2
    if base_2 + t**2 <= radius**2:
        return sign * d * t / 2, mp.mpf(0)
    solid_angle = _solid_angle(mp, height, d, t)
    if height >= radius:
        return mp.mpf(0), sign * radius**2 * solid_angle
    angle, straight = mp.atan2(t, d), mp.mpf(0)
    if base_2 < radius**2:
        leaving = mp.sqrt(radius**2 - base_2)
        angle -= mp.atan2(leaving, d)
        solid_angle -= _solid_angle(mp, height, d, leaving)
        straight = d * leaving / 2
    on_face = straight + (radius**2 - height**2) * angle / 2
    return sign * on_face, sign * radius**2 * (solid_angle - angle * (1 - height / radius))


def _solid_angle(mp: Any, h: Number, d: Number, t: Number) -> Number:
    slant = mp.sqrt(h**2 + d**2 + t**2)
    rise = (d**2 + t**2) / (slant + h)
    return mp.atan2(t * d * rise, d**2 * slant + h * t**2)


def _half_space(mp: Any, center: FloatArray, radius: float, normal: FloatArray, offset: float) -> Truth:
    upward = [mp.mpf(float(x)) for x in normal]
    length, big_r = mp.sqrt(sum(x**2 for x in upward)), mp.mpf(radius)
    below = (mp.mpf(offset) - sum(n * mp.mpf(float(x)) for n, x in zip(upward, center, strict=True))) / length
    if below >= big_r:
        return _whole_sphere(mp, big_r)
    disc, depth = mp.pi * (big_r**2 - below**2), big_r + below
    x, y, z = (-disc * n / length for n in upward)
    return Truth(mp.pi * depth**2 * (3 * big_r - depth) / 3, (x, y, z), 2 * mp.pi * big_r * depth, 1)


def _sphere(mp: Any, center: FloatArray, radius: float, other: FloatArray, other_radius: float) -> Truth:
    towards = [mp.mpf(float(a)) - mp.mpf(float(b)) for a, b in zip(other, center, strict=True)]
    apart, big_r, small_r = mp.sqrt(sum(x**2 for x in towards)), mp.mpf(radius), mp.mpf(other_radius)
    if apart + big_r <= small_r:
        return _whole_sphere(mp, big_r)
    zero = mp.mpf(0)
    if apart + small_r <= big_r:
        return Truth(4 * mp.pi / 3 * small_r**3, (zero, zero, zero), zero)
    deep = big_r + small_r - apart
    volume = mp.pi * deep**2 * (apart**2 + 2 * apart * (big_r + small_r) - 3 * (big_r - small_r) ** 2) / (12 * apart)
    plane = (apart**2 + big_r**2 - small_r**2) / (2 * apart)
    x, y, z = (mp.pi * (big_r**2 - plane**2) * component / apart for component in towards)
    return Truth(volume, (x, y, z), 2 * mp.pi * big_r * (big_r - plane), 1)


def _whole_sphere(mp: Any, radius: Number) -> Truth:
    zero = mp.mpf(0)
    return Truth(4 * mp.pi / 3 * radius**3, (zero, zero, zero), 4 * mp.pi * radius**2)


@functools.cache
def _context(digits: int) -> Any:
    """Return a private context: mpmath's shared one may be changed by others."""
    mp = MPContext()
    mp.dps = digits
    return mp


def _relative(mp: Any, corner: Sequence[Any], origin: Sequence[Number]) -> Point:
    x, y, z = (_number(mp, value) - zero for value, zero in zip(corner, origin, strict=True))
    return x, y, z


def _number(mp: Any, value: Any) -> Number:
    """Convert a float or a Fraction whose denominator is a power of two, without rounding within the digits."""
    return mp.mpf(value.numerator) / value.denominator if hasattr(value, "denominator") else mp.mpf(value)


def _scale(factor: Number, a: Point) -> Point:
    return factor * a[0], factor * a[1], factor * a[2]


def _norm(mp: Any, a: Point) -> Number:
    return mp.sqrt(dot(a, a))
