"""High-precision overlaps of a sphere with a convex polyhedron, derived otherwise than the kernels.

`Polyhedron.overlap` uses the divergence theorem with arcs: the area of each face inside the ball from the
segments and arcs that bound it, and the area of the sphere's surface inside the solid from the Gauss-Bonnet
theorem, whose Euler characteristic is counted from the vertices, edges and faces that the ball reaches. These
are decisions about topology, which is why the arithmetic has 50 digits and the centre is moved by 1e-30 of
the radius out of any degenerate position: the volume changes by less than 4π 1e-30 R³.

`Polyhedron.volume_by_slices` integrates the definition (eq. 11) instead, and checks the former.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from mpmath import mp, mpf

mp.dps = 50

Number = Any
"""An mpmath number; the library is untyped."""
Point = tuple[Number, Number, Number]
Coordinates = Sequence[Any] | npt.NDArray[np.float64]
Rows = Sequence[Coordinates] | npt.NDArray[np.float64]

_OUT_OF_DEGENERACY = (mpf("0.83e-30"), mpf("-0.61e-30"), mpf("0.47e-30"))


def exact(coordinates: Coordinates) -> Point:
    """The three coordinates, each taken as the very number that it stores."""
    x, y, z = coordinates
    return mpf(x), mpf(y), mpf(z)


def _add(a: Point, b: Point, factor: Number = 1) -> Point:
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def _dot(a: Point, b: Point) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _scale(factor: Number, a: Point) -> Point:
    return factor * a[0], factor * a[1], factor * a[2]


def _norm(a: Point) -> Number:
    return mp.sqrt(_dot(a, a))


@dataclass(frozen=True)
class Overlap:
    """Volume (m³), dV/dcentre (m²) and dV/dradius (m²), as mpmath numbers."""

    volume: Number
    gradient: Point
    area: Number


NOTHING = Overlap(mpf(0), (mpf(0), mpf(0), mpf(0)), mpf(0))


@dataclass(frozen=True)
class Polyhedron:
    """A convex polyhedron: `faces` list each face's vertices anticlockwise as seen from outside."""

    vertices: tuple[Point, ...]
    faces: tuple[tuple[int, ...], ...]

    @classmethod
    def tetrahedron(cls, vertices: Rows) -> "Polyhedron":
        """The tetrahedron of four vertices in any order."""
        a, b, c, d = (exact(vertex) for vertex in vertices)
        if _dot(_add(b, a, -1), _cross(_add(c, a, -1), _add(d, a, -1))) < 0:
            c, d = d, c
        return cls((a, b, c, d), ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)))

    @classmethod
    def box(cls, center: Coordinates, rotation: Rows, half_sizes: Coordinates) -> "Polyhedron":
        """The box centre + rotation · diag(half sizes) · [-1, 1]³."""
        rows = [exact(row) for row in rotation]
        half = exact(half_sizes)
        edges = [_scale(half[axis], (rows[0][axis], rows[1][axis], rows[2][axis])) for axis in range(3)]
        if _dot(edges[0], _cross(edges[1], edges[2])) < 0:
            edges[0] = _scale(-1, edges[0])
        vertices = []
        for corner in range(8):
            vertex = exact(center)
            for axis in range(3):
                vertex = _add(vertex, edges[axis], 1 if corner >> axis & 1 else -1)
            vertices.append(vertex)
        faces = ((1, 3, 7, 5), (0, 4, 6, 2), (2, 6, 7, 3), (0, 1, 5, 4), (4, 5, 7, 6), (0, 2, 3, 1))
        return cls(tuple(vertices), faces)

    def volume(self) -> Number:
        """The polyhedron's own volume."""
        total = mpf(0)
        for first, *others in self.faces:
            for second, third in pairwise(others):
                a, b, c = (self.vertices[index] for index in (first, second, third))
                total += _dot(a, _cross(b, c)) / 6
        return total

    def overlap(self, center: Coordinates, radius: Any) -> Overlap:
        """The overlap with a sphere, by the divergence theorem with arcs."""
        big_r = mpf(radius)
        if big_r == 0 or self.volume() == 0:
            return NOTHING
        origin = _add(exact(center), _OUT_OF_DEGENERACY, big_r)
        points = [_add(vertex, origin, -1) for vertex in self.vertices]
        planes = [_Plane.of(*(points[index] for index in face[:3])) for face in self.faces]
        areas_arcs = [
            _area_and_arc(plane, [points[i] for i in face], big_r)
            for plane, face in zip(planes, self.faces, strict=True)
        ]

        vertices_in = sum(_norm(point) < big_r for point in points)
        edges_in, turning = 0, mpf(0)
        for (start, end), (left, right) in self._edges().items():
            crossing = _segment_in_ball(points[start], points[end], big_r)
            if crossing is None:
                continue
            edges_in += 1
            for at, end_of_edge in zip(crossing, (0, 1), strict=True):
                if at != end_of_edge:
                    point = _add(points[start], _add(points[end], points[start], -1), at)
                    turning += _turn(point, planes[left].normal, planes[right].normal)
        faces_in = sum(reached for _, _, reached in areas_arcs)
        if faces_in == 0:
            if any(plane.height < 0 for plane in planes):
                return NOTHING
            return Overlap(4 * mp.pi / 3 * big_r**3, NOTHING.gradient, 4 * mp.pi * big_r**2)
        euler = 2 - (vertices_in - edges_in + faces_in)
        surface = 2 * mp.pi * euler - turning
        moment, gradient = mpf(0), NOTHING.gradient
        for plane, (area, arc, _) in zip(planes, areas_arcs, strict=True):
            surface += plane.height / big_r * arc
            moment += plane.height * area
            gradient = _add(gradient, plane.normal, -area)
        surface *= big_r**2
        return Overlap((moment + big_r * surface) / 3, gradient, surface)

    def volume_by_slices(self, center: Coordinates, radius: Any) -> Number:
        """The overlap's volume as the integral of the area of its horizontal slices, to 15 digits or more."""
        big_r, origin = mpf(radius), exact(center)
        points = [_add(vertex, origin, -1) for vertex in self.vertices]
        levels = {-big_r, big_r, *(point[2] for point in points)}
        for start, end in self._edges():
            for at in _segment_in_ball(points[start], points[end], big_r) or ():
                levels.add(points[start][2] + at * (points[end][2] - points[start][2]))
        for face in self.faces:
            plane = _Plane.of(*(points[index] for index in face[:3]))
            ring_2 = big_r**2 - plane.height**2
            if ring_2 > 0:
                rise = mp.sqrt(ring_2 * max(mpf(0), 1 - plane.normal[2] ** 2))
                levels.update((plane.height * plane.normal[2] + rise, plane.height * plane.normal[2] - rise))
        low = max(-big_r, min(point[2] for point in points))
        high = min(big_r, max(point[2] for point in points))
        inner = sorted(level for level in levels if low <= level <= high)
        with mp.workdps(25):
            return sum(
                (
                    mp.quad(lambda z: self._slice_area(points, z, big_r), [a, b])
                    for a, b in pairwise(inner)
                    if b - a > mpf("1e-22") * big_r
                ),
                mpf(0),
            )

    def _edges(self) -> dict[tuple[int, int], tuple[int, int]]:
        """Each edge once, with the faces on its two sides."""
        sides = {}
        for number, face in enumerate(self.faces):
            for start, end in zip(face, (*face[1:], face[0]), strict=True):
                sides[start, end] = number
        return {edge: (side, sides[edge[::-1]]) for edge, side in sides.items() if edge[0] < edge[1]}

    def _slice_area(self, points: Sequence[Point], z: Number, big_r: Number) -> Number:
        """The area that the polyhedron and the ball have in common at the height z."""
        ring_2 = big_r**2 - z**2
        if ring_2 <= 0:
            return mpf(0)
        ring = mp.sqrt(ring_2)
        total = mpf(0)
        for face in self.faces:
            # A convex face meets the slice in one segment, traversed with the solid on its left.
            ends: dict[bool, Point] = {}
            for start, end in zip(face, (*face[1:], face[0]), strict=True):
                a, b = points[start], points[end]
                if (a[2] > z) != (b[2] > z):
                    ends[a[2] > z] = _add(a, _add(b, a, -1), (z - a[2]) / (b[2] - a[2]))
            if len(ends) == 2:
                total += _disc_sector(ends[True], ends[False], ring)
        return total


@dataclass(frozen=True)
class _Plane:
    normal: Point
    height: Number

    @classmethod
    def of(cls, a: Point, b: Point, c: Point) -> "_Plane":
        normal = _cross(_add(b, a, -1), _add(c, a, -1))
        normal = _scale(1 / _norm(normal), normal)
        return cls(normal, _dot(normal, a))


def _segment_in_ball(a: Point, b: Point, radius: Number) -> tuple[Number, Number] | None:
    """The fractions of a to b between which the segment runs inside the ball at the origin."""
    step = _add(b, a, -1)
    length_2 = _dot(step, step)
    half_b = _dot(a, step)
    discriminant = half_b**2 - length_2 * (_dot(a, a) - radius**2)
    if discriminant <= 0:
        return None
    root = mp.sqrt(discriminant)
    enter, leave = max(mpf(0), (-half_b - root) / length_2), min(mpf(1), (-half_b + root) / length_2)
    return (enter, leave) if enter < leave else None


def _area_and_arc(plane: _Plane, corners: Sequence[Point], radius: Number) -> tuple[Number, Number, bool]:
    """(area of the face in the ball, angle of its circle within the face, whether the ball reaches it)."""
    ring_2 = radius**2 - plane.height**2
    if ring_2 <= 0:
        return mpf(0), mpf(0), False
    foot = _scale(plane.height, plane.normal)
    across = _add(corners[1], corners[0], -1)
    across = _scale(1 / _norm(across), across)
    along = _cross(plane.normal, across)
    flat = [(_dot(_add(p, foot, -1), across), _dot(_add(p, foot, -1), along)) for p in corners]
    edges = list(zip(flat, [*flat[1:], flat[0]], strict=True))

    def inside(x: Number, y: Number) -> bool:
        return all((b[0] - a[0]) * (y - a[1]) > (b[1] - a[1]) * (x - a[0]) for a, b in edges)

    ring = mp.sqrt(ring_2)
    area, angles = mpf(0), []
    reached = inside(mpf(0), mpf(0))
    for a, b in edges:
        crossing = _segment_in_ball((*a, mpf(0)), (*b, mpf(0)), ring)
        if crossing is None:
            continue
        reached = True
        area += (crossing[1] - crossing[0]) * (a[0] * b[1] - a[1] * b[0]) / 2
        for at, end_of_edge in zip(crossing, (0, 1), strict=True):
            if at != end_of_edge:
                angles.append(mp.atan2(a[1] + at * (b[1] - a[1]), a[0] + at * (b[0] - a[0])))
    if angles:
        angles.sort()
        turns = [*pairwise(angles), (angles[-1], angles[0] + 2 * mp.pi)]
    else:
        turns = [(mpf(0), 2 * mp.pi)]
    arc = mpf(0)
    for start, end in turns:
        middle = (start + end) / 2
        if inside(ring * mp.cos(middle), ring * mp.sin(middle)):
            arc += end - start
    return area + ring_2 * arc / 2, arc, reached


def _turn(point: Point, first: Point, second: Point) -> Number:
    """The exterior angle at `point` of the sphere's surface between the planes with these outward normals."""
    upward = _scale(1 / _norm(point), point)
    flat_first = _add(first, upward, -_dot(first, upward))
    flat_second = _add(second, upward, -_dot(second, upward))
    return mp.atan2(_norm(_cross(flat_first, flat_second)), _dot(flat_first, flat_second))


def _disc_sector(a: Point, b: Point, ring: Number) -> Number:
    """The signed area of the triangle origin, a, b in the plane that lies within a disc about the origin."""

    def sector(p: Point, q: Point) -> Number:
        return ring**2 / 2 * mp.atan2(p[0] * q[1] - p[1] * q[0], p[0] * q[0] + p[1] * q[1])

    a, b = (a[0], a[1], mpf(0)), (b[0], b[1], mpf(0))
    crossing = _segment_in_ball(a, b, ring)
    if crossing is None:
        return sector(a, b)
    enter, leave = (_add(a, _add(b, a, -1), at) for at in crossing)
    return sector(a, enter) + (enter[0] * leave[1] - enter[1] * leave[0]) / 2 + sector(leave, b)
