"""Whether an open ball meets a solid's interior, decided exactly in whole numbers.

Doubles are whole multiples of powers of two, so every coordinate of a pair becomes a Python integer once a common
power of two is divided out, and no sign below is rounded. A ball meets the interior of a convex solid when the
distance from its centre to the solid is less than the radius: the centre lies inside, or a vertex, or the foot
of the perpendicular on an edge or a face is nearer than that. Most pairs are decided by doubles with a margin
beforehand.
"""

from fractions import Fraction
from math import lcm

import numpy as np

from common.arrays import BoolArray, FloatArray
from feelahead.benchmarks.overlap.pairs import BOX_QUADRILATERALS, BOX_SIGNS, TETRAHEDRON_TRIANGLES, Pairs

_MARGIN = 1e-9
"""Relative distance from contact within which doubles do not decide."""

Whole = tuple[int, int, int]


def contacts(pairs: Pairs) -> BoolArray:
    """(p,): whether each open ball meets the interior of its solid, for the doubles exactly as they are."""
    decided, touching = _decided_by_doubles(pairs)
    for row in np.flatnonzero(~decided):
        touching[row] = exact_contact(pairs, int(row))
    return touching


def exact_contact(pairs: Pairs, row: int) -> bool:
    """Whether the open ball of this row meets the interior of its solid."""
    center = [Fraction(float(x)) for x in pairs.centers[row]]
    radius = Fraction(float(pairs.radii[row]))
    if radius == 0:
        return False
    if pairs.solid == "half-space":
        normal = [Fraction(float(x)) for x in pairs.parameters[0][row]]
        beyond = sum(n * x for n, x in zip(normal, center, strict=True)) - Fraction(float(pairs.parameters[1][row]))
        return beyond < 0 or beyond**2 < radius**2 * sum(n * n for n in normal)
    if pairs.solid == "sphere":
        other = Fraction(float(pairs.parameters[1][row]))
        apart_2 = sum((Fraction(float(a)) - b) ** 2 for a, b in zip(pairs.parameters[0][row], center, strict=True))
        return other > 0 and apart_2 < (radius + other) ** 2
    corners = exact_corners(pairs, row)
    denominator = lcm(radius.denominator, *(x.denominator for point in (center, *corners) for x in point))
    whole = [_whole([x - c for x, c in zip(corner, center, strict=True)], denominator) for corner in corners]
    faces = TETRAHEDRON_TRIANGLES if pairs.solid == "tetrahedron" else BOX_QUADRILATERALS
    return _origin_within(whole, faces, int(radius * denominator) ** 2)


def exact_corners(pairs: Pairs, row: int) -> list[list[Fraction]]:
    """The corners of a tetrahedron, right-handed or not, or those of a box, without rounding."""
    if pairs.solid == "tetrahedron":
        return [[Fraction(float(x)) for x in vertex] for vertex in pairs.parameters[0][row]]
    place, turn, half_sizes = ([Fraction(float(x)) for x in values[row].ravel()] for values in pairs.parameters)
    return [
        [place[axis] + sum(turn[3 * axis + k] * half_sizes[k] * int(signs[k]) for k in range(3)) for axis in range(3)]
        for signs in BOX_SIGNS
    ]


def _whole(point: list[Fraction], denominator: int) -> Whole:
    x, y, z = (int(coordinate * denominator) for coordinate in point)
    return x, y, z


def _origin_within(corners: list[Whole], faces: tuple[tuple[int, ...], ...], reach_2: int) -> bool:
    """Whether the origin lies nearer than √`reach_2` to the convex solid, which has an interior."""
    a, b = corners[0], corners[1]
    fourth = corners[3] if len(corners) == 4 else corners[4]
    volume = _dot(_cross(_minus(b, a), _minus(corners[2], a)), _minus(fourth, a))
    if volume == 0:
        return False
    if any(_dot(corner, corner) < reach_2 for corner in corners):
        return True
    handed = 1 if volume > 0 else -1
    if len(corners) == 8:
        # The corners count along the last axis first, which makes edges 1, 2, 4 left-handed in a right-handed box.
        handed = -handed
    inside = True
    for face in faces:
        ring = [corners[index] for index in face]
        normal = _cross(_minus(ring[1], ring[0]), _minus(ring[2], ring[0]))
        height = handed * _dot(normal, ring[0])
        if height > 0:
            continue
        inside = False
        if _face_within(ring, normal, reach_2):
            return True
    return inside


def _face_within(ring: list[Whole], normal: Whole, reach_2: int) -> bool:
    """Whether the foot of the origin on the face or on one of its edges exists and is nearer than √`reach_2`."""
    foot_on_face = True
    for start, end in zip(ring, (*ring[1:], ring[0]), strict=True):
        along = _minus(end, start)
        across = _cross(start, along)
        # The foot on the plane is on the inner side of an edge when normal · (along × (foot - start)) > 0.
        foot_on_face = foot_on_face and _dot(normal, across) >= 0
        length_2 = _dot(along, along)
        if 0 < -_dot(start, along) < length_2 and _dot(across, across) < reach_2 * length_2:
            return True
    return foot_on_face and _dot(normal, ring[0]) ** 2 < reach_2 * _dot(normal, normal)


def _minus(a: Whole, b: Whole) -> Whole:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Whole, b: Whole) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Whole, b: Whole) -> Whole:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _decided_by_doubles(pairs: Pairs) -> tuple[BoolArray, BoolArray]:
    """(Whether doubles are sure, what they say), each (p,).

    Any point of the solid bounds the distance from above and any plane that has the solid on one side bounds it
    from below, so a poor nearest point makes a pair undecided but never wrong.
    """
    count = len(pairs)
    if pairs.solid in ("half-space", "sphere"):
        return np.zeros(count, bool), np.zeros(count, bool)
    corners = pairs.corners - pairs.centers[:, None]
    sizes = np.linalg.norm(corners - corners[:, :1], axis=2).max(axis=1)
    # A solid nearly without volume is left to whole numbers.
    solid = pairs.solid_volumes > 1e-6 * sizes**3
    nearest = nearest_points(corners, triangles_of(pairs))
    most = np.linalg.norm(nearest, axis=1)
    towards = nearest / np.where(most == 0.0, 1.0, most)[:, None]
    least = np.einsum("nvi,ni->nv", corners, towards).min(axis=1)
    margin = _MARGIN * (pairs.radii + sizes) + 64.0 * np.finfo(float).eps * pairs.scales
    touching = solid & (most < pairs.radii - margin)
    apart = least > pairs.radii + margin
    return touching | apart, touching


def triangles_of(pairs: Pairs) -> tuple[tuple[int, ...], ...]:
    """The triangles, as corner numbers, that make the surface of the tetrahedra or boxes."""
    if pairs.solid == "tetrahedron":
        return TETRAHEDRON_TRIANGLES
    return tuple((face[0], face[k], face[k + 1]) for face in BOX_QUADRILATERALS for k in (1, 2))


def nearest_points(corners: FloatArray, triangles: tuple[tuple[int, ...], ...]) -> FloatArray:
    """(p, 3): the points of the triangles nearest to the origin, to rounding."""
    best = corners[:, 0].copy()
    for triangle in triangles:
        a, b, c = (corners[:, index] for index in triangle)
        for start, end in ((a, b), (b, c), (c, a)):
            _keep_nearer(best, _on_segment(start, end))
        normal = np.cross(b - a, c - a)
        size = np.einsum("ni,ni->n", normal, normal)
        safe = np.where(size == 0.0, 1.0, size)
        foot = normal * (np.einsum("ni,ni->n", normal, a) / safe)[:, None]
        within = size > 0.0
        for start, end in ((a, b), (b, c), (c, a)):
            within &= np.einsum("ni,ni->n", normal, np.cross(end - start, foot - start)) >= 0.0
        _keep_nearer(best, np.where(within[:, None], foot, best))
    return best


def _on_segment(start: FloatArray, end: FloatArray) -> FloatArray:
    along = end - start
    length_2 = np.einsum("ni,ni->n", along, along)
    fraction = -np.einsum("ni,ni->n", start, along) / np.where(length_2 == 0.0, 1.0, length_2)
    return np.asarray(start + np.clip(fraction, 0.0, 1.0)[:, None] * along)


def _keep_nearer(best: FloatArray, other: FloatArray) -> None:
    nearer = np.einsum("ni,ni->n", other, other) < np.einsum("ni,ni->n", best, best)
    best[nearer] = other[nearer]
