"""Shapes of a scene as triangles for a browser: one mesh, made by trimesh, for all shapes that differ only in size.

Vertices are (v, 3) float32 in metres; triangles are (t, 3) uint32, counterclockwise seen from outside.
"""

from functools import cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.protocol.view_messages import Shape

if TYPE_CHECKING:
    import trimesh

Floats = NDArray[np.float32]
_SIDES: Final = 24
"""Number of sides of a drawn cylinder or capsule"""
_ENDLESS_M: Final = 2.0
"""Half size at which an endless plane is drawn"""
_SHEET_M: Final = 1e-3
"""Half thickness at which a plane is drawn"""


class Solid(NamedTuple):
    """Mesh of a shape, before it is scaled along each axis."""

    vertices: Floats
    triangles: NDArray[np.uint32]
    flat: bool = False
    """Whether to shade each triangle flat, so that edges look sharp"""


def solid_of(shape: Shape) -> tuple[tuple[object, ...], Solid, tuple[float, float, float]]:
    """Return a key, a mesh, and the mesh's scale along x, y and z. Shapes with equal keys share the mesh."""
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
        drum = _creation().cylinder(radius=1.0, height=2.0, sections=_SIDES)
        return ("cylinder",), _solid(drum, flat=True), (x, x, y)
    if shape.kind == "capsule":
        pill = _creation().capsule(height=2.0 * y, radius=x, count=[_SIDES, _SIDES])
        return ("capsule", x, y), _solid(pill), (1.0, 1.0, 1.0)
    vertices = np.frombuffer(shape.vertices_m, np.float32).reshape(-1, 3)
    triangles = np.frombuffer(shape.triangles, np.uint32).reshape(-1, 3)
    return ("mesh", shape.vertices_m, shape.triangles), Solid(vertices, triangles, flat=True), (x, y, z)


@cache
def box() -> Solid:
    """Return a box with half sizes of 1."""
    return _solid(_creation().box((2.0, 2.0, 2.0)), flat=True)


@cache
def sphere(divisions: int = 2) -> Solid:
    """Return a sphere of radius 1: an icosahedron, each triangle divided into four, `divisions` times over."""
    return _solid(_creation().icosphere(subdivisions=divisions))


def _creation() -> Any:
    """Return the makers of shapes of trimesh, which is slow to load: the console shows its address first."""
    from trimesh import creation  # noqa: PLC0415

    return creation


def _solid(mesh: "trimesh.Trimesh", *, flat: bool = False) -> Solid:
    return Solid(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32), flat)
