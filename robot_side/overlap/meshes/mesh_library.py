"""Several meshes in one set of arrays, so that one kernel call can handle all pairs of a sphere and a placed mesh."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_kernels import nearest_loop
from robot_side.overlap.meshes.mesh_tables import joined

_FLAT_M = 1e-7
"""Depth of a dent, in m, up to which a mesh counts as convex"""
_BATCH = 64
"""Number of triangles that are tested together for dents. The test ends at the first dent, which most meshes with dents
show early."""


@dataclass(frozen=True)
class MeshBounds:
    """Bounding boxes along the axes of m meshes in their own frames, and bounding spheres about the boxes' middles."""

    middles_m: FloatArray
    """Middle of each box, and centre of each sphere (m, 3)"""
    half_sizes_m: FloatArray
    """Half the size of each box along the axes (m, 3)"""
    radii_m: FloatArray
    """Radius of each sphere (m,)"""


class Source(NamedTuple):
    """What a mesh is made from."""

    vertices_m: bytes
    """(v, 3) float64"""
    triangles: bytes
    """(t, 3) int64"""

    def mesh(self) -> Mesh:
        """Return the mesh."""
        vertices_m = np.frombuffer(self.vertices_m).reshape(-1, 3)
        return Mesh(vertices_m, np.frombuffer(self.triangles, dtype=np.int64).reshape(-1, 3))


class MeshLibrary:
    """Meshes to which a scene refers by their indices; immutable. ValueError for an empty list."""

    def __init__(self, meshes: Sequence[Mesh], sources: tuple[Source, ...] = ()) -> None:
        """sources: what each mesh was made from, if a recording has to hold it; a model's meshes are known."""
        self.sources = sources
        if not meshes:
            raise ValueError("meshes is empty; valid: one mesh or more")
        for index, mesh in enumerate(meshes):
            if not isinstance(mesh, Mesh):
                raise ValueError(f"meshes[{index}] is of type {type(mesh).__name__}; valid: a Mesh")
        self.tables = joined([mesh.tables for mesh in meshes])

    def __len__(self) -> int:
        return len(self.tables.volumes)

    @cached_property
    def bounds(self) -> MeshBounds:
        """Bounding boxes and spheres of the meshes"""
        tables = self.tables
        roots = tables.roots[:-1]
        lowest, highest = tables.boxes[roots, :3], tables.boxes[roots, 3:]
        middles = 0.5 * (lowest + highest)
        first_triangles = tables.links.reshape(-1, 3)[roots, 1]
        corners = tables.triangles[:, :9].reshape(-1, 3, 3)
        counts = np.diff(first_triangles, append=len(corners))
        apart = np.linalg.norm(corners - np.repeat(middles, counts, axis=0)[:, None, :], axis=2).max(axis=1)
        return MeshBounds(middles, 0.5 * (highest - lowest), np.maximum.reduceat(apart, first_triangles))

    @cached_property
    def convex(self) -> BoolArray:
        """Whether each mesh (m,) is convex: none of its corners lies in front of any of its triangles"""
        tables = self.tables
        first = tables.links.reshape(-1, 3)[tables.roots[:-1], 1]
        parts = (np.split(part, first[1:]) for part in (tables.triangles[:, :9], tables.triangles[:, 9:12]))
        return np.array([_is_convex(*part) for part in zip(*parts, strict=True)])

    @property
    def corners_m(self) -> list[FloatArray]:
        """Triangles (t, 3, 3) of each mesh in its own frame"""
        first_triangles = self.tables.links.reshape(-1, 3)[self.tables.roots[:-1], 1]
        return np.split(self.tables.triangles[:, :9].reshape(-1, 3, 3), first_triangles[1:])

    def placed_middles_m(self, mesh_index: IntArray, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Return the middles (q, 3) of the bounding volumes of placed meshes, in the world frame.

        mesh_index (q,), positions (q, 3), rotations (q, 3, 3): as for `nearest_mesh_pairs`.
        """
        middles = self.bounds.middles_m.take(mesh_index, axis=0)
        placed: FloatArray = positions + np.einsum("qij,qj->qi", rotations, middles)
        return placed


def _is_convex(corners: FloatArray, normals: FloatArray) -> bool:
    """Return whether triangles with `corners` (t, 9) and outward `normals` (t, 3) bound a convex solid."""
    first, places = corners[:, :3], np.unique(corners.reshape(-1, 3), axis=0)
    offsets = np.einsum("ti,ti->t", normals, first)
    return all(
        (places @ normals[few].T <= offsets[few] + _FLAT_M).all()
        for few in np.array_split(np.arange(len(normals)), 1 + len(normals) // _BATCH)
    )


def nearest_mesh_pairs(
    centers: FloatArray, library: MeshLibrary, mesh_index: IntArray, positions: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return each point's signed distance (p,) in m from one placed mesh, negative inside, and a unit vector (p, 3).

    The signed distance falls fastest along this vector. From outside it points towards the nearest point of the
    surface, from inside away from that point. centers (p, 3): the points. mesh_index (p,) int64: each one's mesh.
    positions (p, 3): the meshes'; rotations (p, 3, 3) turn from their frames to the world's. Nothing is checked: a
    wrong index would read beyond the arrays.
    """
    distances, directions = np.empty(len(centers)), np.empty((len(centers), 3))
    nearest_loop(centers, mesh_index, positions, rotations, library.tables, distances, directions)
    return distances, directions
