"""Closed meshes for the geoms that no simpler primitive describes, made once when a scene is loaded.

Only a scene that needs meshes imports this module, because it compiles their kernels.
"""

import math
from dataclasses import dataclass
from typing import Any

# A scene with meshes also runs these kernels; imported here, they are warmed up.
import robot_side.surroundings.placed_meshes  # noqa: F401
from robot_side.drivers.mujoco.mesh_arrays import height_field_surface, mesh_triangles, mesh_vertices
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.overlap.meshes.closed_surface import signed_volume
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_library import MeshLibrary
from robot_side.overlap.meshes.mesh_shapes import (
    ShapeMesh,
    capsule_mesh,
    convex_hull_mesh,
    cylinder_mesh,
)

_LARGEST_VOLUME_ERROR = 0.01
"""Largest share by which the volume of a mesh around a round shape may exceed the shape's"""
_STANDS_OUT_M = 5e-4
"""Largest distance, in m, by which such a mesh may protrude; the finest mesh is used even if it protrudes more"""
_SEGMENTS = range(8, 129, 4)
_SUBDIVISIONS = range(4, 25)
_BY_NUMBER = {GeomKind.MESH, GeomKind.HFIELD}
"""Kinds whose shapes the model lists by number, so that geoms with the same number have the same shape."""


@dataclass(frozen=True)
class GeomMesh:
    """Mesh of a shape, in the frame of every geom with this shape."""

    mesh: Mesh
    volume_error: float
    """Volume by which the mesh exceeds the shape, as a share of the shape's; infinite for a shape that encloses none"""
    stands_out_m: float
    """Distance, in m, by which the mesh protrudes from the shape; infinite for a shape that encloses nothing"""


class GeomMeshes:
    """Meshes of a model's geoms; geoms of the same shape share one mesh."""

    def __init__(self, model: Any) -> None:
        """Begin without meshes. model: a compiled MuJoCo model."""
        self._model = model
        self._shapes: dict[tuple[Any, ...], tuple[int, GeomMesh] | None] = {}

    def add(self, geom: int) -> tuple[int, GeomMesh] | None:
        """Return the index of the geom's mesh in `mesh_library`, and the mesh; None if no mesh can be made.

        A round shape gets a mesh that contains it. A height field is exact. A mesh geom is exact if its surface is
        closed and each part is oriented consistently; otherwise it gets its convex hull, as in the simulation's
        contacts.
        """
        kind = GeomKind(self._model.geom_type[geom])
        size = tuple(self._model.geom_size[geom].tolist())
        key = (kind, int(self._model.geom_dataid[geom])) if kind in _BY_NUMBER else (kind, *size)
        if key not in self._shapes:
            made = self._make(geom, kind, size)
            count = sum(shape is not None for shape in self._shapes.values())
            self._shapes[key] = None if made is None else (count, made)
        return self._shapes[key]

    def _make(self, geom: int, kind: GeomKind, size: tuple[float, ...]) -> GeomMesh | None:
        if kind is GeomKind.HFIELD:
            return GeomMesh(Mesh(*height_field_surface(self._model, geom)), 0.0, 0.0)
        return _mesh_geom(self._model, geom) if kind is GeomKind.MESH else _round_geom(kind, size)

    def mesh_library(self) -> MeshLibrary | None:
        """Return the library of all meshes made so far; None without meshes."""
        meshes = [shape[1].mesh for shape in self._shapes.values() if shape is not None]
        return MeshLibrary(meshes) if meshes else None


def _round_geom(kind: GeomKind, size: tuple[float, ...]) -> GeomMesh | None:
    """Return the coarsest mesh around the shape that is within both limits of excess, else the finest mesh."""
    finenesses = _SEGMENTS if kind is GeomKind.CYLINDER else _SUBDIVISIONS
    for fineness in finenesses:
        if (made := _around(kind, size, fineness)) is None:
            return None
        small = made.excess <= _LARGEST_VOLUME_ERROR and made.stands_out_m <= _STANDS_OUT_M
        if small or fineness == finenesses[-1]:
            try:
                return GeomMesh(Mesh(made.vertices, made.triangles), made.excess, made.stands_out_m)
            except ValueError:
                # So thin that its vertices coincide.
                return None
    return None


def _around(kind: GeomKind, size: tuple[float, ...], fineness: int) -> ShapeMesh | None:
    match kind:
        case GeomKind.CYLINDER:
            return cylinder_mesh(size[0], size[1], fineness)
        case GeomKind.CAPSULE:
            return capsule_mesh(size[0], size[1], fineness)
        case _:
            return None


def _mesh_geom(model: Any, geom: int) -> GeomMesh | None:
    vertices, triangles = mesh_vertices(model, geom), mesh_triangles(model, geom)
    if signed_volume(vertices[triangles]) < 0.0:
        triangles = triangles[:, ::-1]
    try:
        return GeomMesh(Mesh(vertices, triangles), 0.0, 0.0)
    except ValueError:
        pass
    try:
        hull = convex_hull_mesh(vertices)
        return GeomMesh(Mesh(hull.vertices, hull.triangles), math.inf, math.inf)
    except ValueError:
        # All in one plane.
        return None
