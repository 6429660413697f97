"""Decide exactly, by whole numbers, whether a ball overlaps a solid; merely touching is no overlap.

Each double is a whole multiple of a power of two. So all coordinates of a pair become Python integers once a common
power of two is divided out, and no sign below depends on rounding. A ball overlaps a convex solid if the solid is
nearer to the centre than the radius. Then the centre is inside, or one of these points is nearer than the radius: a
vertex, or the foot of the perpendicular on an edge or a face.
"""

from fractions import Fraction
from math import lcm
from typing import Any

import numpy as np

from common.arrays import BoolArray
from feelahead.lab.reference.pairs import BOX_QUADRILATERALS, BOX_SIGNS, TETRAHEDRON_TRIANGLES, Pairs

Point = tuple[Any, Any, Any]
"""Point (x, y, z): of whole numbers here, of mpmath's numbers in the oracle."""


def contacts(pairs: Pairs) -> BoolArray:
    """Return for each pair (p,) whether the open ball meets the solid's interior, without rounding the doubles."""
    return np.array([exact_contact(pairs, row) for row in range(len(pairs))])


def exact_contact(pairs: Pairs, row: int) -> bool:
    """Return whether the open ball of this row meets the interior of the solid."""
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
    """Return the corners of a tetrahedron, right-handed or not, or those of a box, without rounding."""
    if pairs.solid == "tetrahedron":
        return [[Fraction(float(x)) for x in vertex] for vertex in pairs.parameters[0][row]]
    place, turn, half_sizes = ([Fraction(float(x)) for x in values[row].ravel()] for values in pairs.parameters)
    return [
        [place[axis] + sum(turn[3 * axis + k] * half_sizes[k] * int(signs[k]) for k in range(3)) for axis in range(3)]
        for signs in BOX_SIGNS
    ]


def _whole(point: list[Fraction], denominator: int) -> Point:
    x, y, z = (int(coordinate * denominator) for coordinate in point)
    return x, y, z


def _origin_within(corners: list[Point], faces: tuple[tuple[int, ...], ...], reach_2: int) -> bool:
    """Return whether the origin is nearer than √`reach_2` to the convex solid, which has an interior."""
    a, b = corners[0], corners[1]
    fourth = corners[3] if len(corners) == 4 else corners[4]
    volume = dot(cross(minus(b, a), minus(corners[2], a)), minus(fourth, a))
    if volume == 0:
        return False
    if any(dot(corner, corner) < reach_2 for corner in corners):
        return True
    handed = 1 if volume > 0 else -1
    if len(corners) == 8:
        # The corners count along the last axis first, which makes edges 1, 2, 4 left-handed in a right-handed box.
        handed = -handed
    inside = True
    for face in faces:
        ring = [corners[index] for index in face]
        normal = cross(minus(ring[1], ring[0]), minus(ring[2], ring[0]))
        height = handed * dot(normal, ring[0])
        if height > 0:
            continue
        inside = False
        if _face_within(ring, normal, reach_2):
            return True
    return inside


def _face_within(ring: list[Point], normal: Point, reach_2: int) -> bool:
    """Return whether the origin's foot on the face or on an edge of it exists and is nearer than √`reach_2`."""
    foot_on_face = True
    for start, end in zip(ring, (*ring[1:], ring[0]), strict=True):
        along = minus(end, start)
        across = cross(start, along)
        # The foot on the plane is on the inner side of an edge when normal · (along × (foot - start)) > 0.
        foot_on_face = foot_on_face and dot(normal, across) >= 0
        length_2 = dot(along, along)
        if 0 < -dot(start, along) < length_2 and dot(across, across) < reach_2 * length_2:
            return True
    return foot_on_face and dot(normal, ring[0]) ** 2 < reach_2 * dot(normal, normal)


def minus(a: Point, b: Point) -> Point:
    """Return a - b, without rounding if the numbers are whole."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a: Point, b: Point) -> Any:
    """Return the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Point, b: Point) -> Point:
    """Return the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
