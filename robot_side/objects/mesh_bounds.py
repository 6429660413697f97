"""Spheres and boxes around meshes: worked out once for each library, and placed with the meshes."""

import weakref
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from common.arrays import FloatArray
from robot_side.objects.perceived import PerceivedObjects

if TYPE_CHECKING:
    from robot_side.overlap.meshes.mesh_library import MeshLibrary


@dataclass(frozen=True)
class MeshBounds:
    """What contains each of m meshes, in its own frame: a box along the axes, and a sphere about the same middle."""

    middles_m: FloatArray
    """(m, 3)"""
    half_sizes_m: FloatArray
    """(m, 3)"""
    radii_m: FloatArray
    """(m,)"""


_bounds: "weakref.WeakKeyDictionary[MeshLibrary, MeshBounds]" = weakref.WeakKeyDictionary()


def mesh_bounds(library: "MeshLibrary") -> MeshBounds:
    """The bounds of the library's meshes."""
    known = _bounds.get(library)
    if known is None:
        known = _bounds[library] = _work_out(library)
    return known


def placed_middles(objects: PerceivedObjects) -> FloatArray:
    """(q, 3) the middles of the bounds of the objects' meshes in the world frame, in metres."""
    if objects.mesh_library is None:
        return objects.mesh_positions_m
    middles = mesh_bounds(objects.mesh_library).middles_m.take(objects.mesh_index, axis=0)
    placed: FloatArray = objects.mesh_positions_m + np.einsum("qij,qj->qi", objects.mesh_rotations, middles)
    return placed


def mesh_corners(library: "MeshLibrary") -> list[FloatArray]:
    """Each mesh's triangles (t, 3, 3) in its own frame, in metres."""
    tables = library.tables
    first_triangles = tables.links.reshape(-1, 3)[tables.roots[:-1], 1]
    return np.split(tables.triangles[:, :9].reshape(-1, 3, 3), first_triangles[1:])


def _work_out(library: "MeshLibrary") -> MeshBounds:
    tables = library.tables
    roots = tables.roots[:-1]
    lowest, highest = tables.boxes[roots, :3], tables.boxes[roots, 3:]
    middles = 0.5 * (lowest + highest)
    first_triangles = tables.links.reshape(-1, 3)[roots, 1]
    corners = tables.triangles[:, :9].reshape(-1, 3, 3)
    counts = np.diff(first_triangles, append=len(corners))
    apart = np.linalg.norm(corners - np.repeat(middles, counts, axis=0)[:, None, :], axis=2).max(axis=1)
    return MeshBounds(middles, 0.5 * (highest - lowest), np.maximum.reduceat(apart, first_triangles))
