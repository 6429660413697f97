"""The shapes of a scene as triangles that a browser draws: one mesh for all that are alike up to their size.

Vertices (v, 3) float32 in metres, triangles (t, 3) uint32, seen from outside counterclockwise.
"""

from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.protocol.view_messages import Shape

Floats = NDArray[np.float32]
_SIDES: Final = 24
_RINGS: Final = 6
_ENDLESS_M: Final = 2.0
_SHEET_M: Final = 1e-3
_GOLDEN: Final = (1.0 + 5.0**0.5) / 2.0


class Solid(NamedTuple):
    """Triangles, before they are scaled along each axis."""

    vertices: Floats
    triangles: NDArray[np.uint32]
    flat: bool = False
    """Whether its edges are sharp"""


def solid_of(shape: Shape) -> tuple[tuple[object, ...], Solid, tuple[float, float, float]]:
    """What a shape is drawn as: a key that is equal for what shares a mesh, that mesh, and its scale."""
    x, y, z = shape.size_m
    if shape.kind == "box":
        return ("box",), box(), (x, y, z)
    if shape.kind == "plane":
        return ("box",), box(), (x or _ENDLESS_M, y or _ENDLESS_M, _SHEET_M)
    if shape.kind == "sphere":
        return ("sphere",), sphere(), (x, x, x)
    if shape.kind == "ellipsoid":
        return ("sphere",), sphere(), (x, y, z)
    if shape.kind == "cylinder":
        return ("cylinder",), lathe(((0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 1.0))), (x, x, y)
    if shape.kind == "capsule":
        angles = np.linspace(0.0, np.pi / 2.0, _RINGS)
        upper = [(x * float(np.sin(angle)), y + x * float(np.cos(angle))) for angle in angles]
        return ("capsule", x, y), lathe((*((r, -h) for r, h in upper), *reversed(upper))), (1.0, 1.0, 1.0)
    vertices = np.frombuffer(shape.vertices_m, np.float32).reshape(-1, 3)
    triangles = np.frombuffer(shape.triangles, np.uint32).reshape(-1, 3)
    return ("mesh", shape.vertices_m, shape.triangles), Solid(vertices, triangles, flat=True), (x, y, z)


@cache
def box() -> Solid:
    """Half sizes of 1."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles = [corner for a, b, c, d in faces for corner in ((a, b, c), (a, c, d))]
    return Solid(corners, np.array(triangles, np.uint32), flat=True)


@cache
def sphere(divisions: int = 2) -> Solid:
    """Radius 1: an icosahedron whose triangles are divided into four so many times."""
    g = _GOLDEN
    corners: list[tuple[float, float, float]] = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    corners += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    vertices = [np.array(corner) / np.hypot(1.0, g) for corner in corners]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    triangles += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    triangles += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    middles: dict[tuple[int, int], int] = {}

    def middle(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middles:
            between = vertices[a] + vertices[b]
            middles[key] = len(vertices)
            vertices.append(between / np.linalg.norm(between))
        return middles[key]

    for _ in range(divisions):
        finer = []
        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return Solid(np.array(vertices, np.float32), np.array(triangles, np.uint32))


def lathe(profile: tuple[tuple[float, float], ...]) -> Solid:
    """A profile of (radius, height), from the bottom up, turned around z."""
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = [np.column_stack([radius * around, np.full(_SIDES, height)]) for radius, height in profile]
    triangles = []
    for ring in range(len(rings) - 1):
        for side in range(_SIDES):
            a, b = ring * _SIDES + side, ring * _SIDES + (side + 1) % _SIDES
            triangles += [(a, b, b + _SIDES), (a, b + _SIDES, a + _SIDES)]
    return Solid(np.concatenate(rings).astype(np.float32), np.array(triangles, np.uint32), flat=len(profile) == 4)
