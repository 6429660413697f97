"""Several meshes in one set of arrays, so that one kernel call handles all pairs of a sphere and a placed mesh."""

from collections.abc import Sequence

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.overlap.closed_forms.solid import Overlaps
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_kernels import nearest_loop, overlap_loop
from robot_side.overlap.meshes.mesh_tables import joined


class MeshLibrary:
    """The meshes that a scene places, each named by its index; it does not change. ValueError for none."""

    def __init__(self, meshes: Sequence[Mesh]) -> None:
        if not meshes:
            raise ValueError("meshes is empty; valid: one mesh or more")
        for index, mesh in enumerate(meshes):
            if not isinstance(mesh, Mesh):
                raise ValueError(f"meshes[{index}] is a {type(mesh).__name__}; valid: a Mesh")
        self.tables = joined([mesh.tables for mesh in meshes])

    def __len__(self) -> int:
        return len(self.tables.volumes)


def mesh_pairs(
    centers: FloatArray,
    radii: FloatArray,
    library: MeshLibrary,
    mesh_index: IntArray,
    positions: FloatArray,
    rotations: FloatArray,
) -> Overlaps:
    """Spheres `centers` (p, 3), `radii` (p,) with meshes `mesh_index` (p,) int64 at `positions` (p, 3).

    `rotations` (p, 3, 3) turn each mesh's frame to the world's. Returns (volumes (p,), gradients (p, 3), areas (p,)) as
    `kernels` does, and like it checks nothing: an index that the library lacks reads beyond its arrays.
    """
    count = len(radii)
    volumes, gradients, areas = np.empty(count), np.empty((count, 3)), np.empty(count)
    touched = np.empty(count, dtype=np.int64)
    arrays = mesh_index, positions, rotations
    overlap_loop(centers, radii, np.arange(count), *arrays, *library.tables, volumes, gradients, areas, touched)
    return volumes, gradients, areas


def nearest_mesh_pairs(
    centers: FloatArray, library: MeshLibrary, mesh_index: IntArray, positions: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(signed distances (p,) in m, negative inside; unit directions (p, 3)) of points and placed meshes.

    The direction is that in which the signed distance falls fastest: towards the
    nearest point of the surface from outside, away from it from inside. Arguments as for `mesh_pairs`.
    """
    distances, directions = np.empty(len(centers)), np.empty((len(centers), 3))
    nearest_loop(centers, mesh_index, positions, rotations, *library.tables, distances, directions)
    return distances, directions
