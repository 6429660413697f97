"""Tables for the mesh kernels: triangles in the order of their tree, and the tree, of one or several meshes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.overlap.meshes.triangle_tree import LINKS, build_tree

FIELDS = 16
"""Numbers for each triangle in `MeshTables.triangles`"""


class MeshTables(NamedTuple):
    """Flat arrays of m meshes with t triangles and n nodes in all; lengths in m."""

    triangles: FloatArray
    """(t, 16) corners (9), outward unit normal (3), inverse edge lengths (3, from corner i to i + 1), longest edge"""
    spheres: FloatArray
    """(t, 4) centre and radius of a ball around each triangle"""
    boxes: FloatArray
    """(n, 6) see `TriangleTree`"""
    links: IntArray
    """(3 n,) see `TriangleTree`, with indices into these arrays"""
    moments: FloatArray
    """(n, 7) see `TriangleTree`"""
    roots: IntArray
    """(m + 1,) root node of each mesh, and n"""
    volumes: FloatArray
    """(m,) volume of each mesh (m³)"""

    def room(self) -> IntArray:
        """Return uninitialised scratch (t + 1,) for the triangles near a sphere, and one more."""
        return np.empty(len(self.triangles) + 1, dtype=np.int64)


def mesh_tables(corners: FloatArray, volume: float) -> MeshTables:
    """Return the tables of one mesh with the triangles `corners` (t, 3, 3)."""
    tree = build_tree(corners)
    corners = corners[tree.order]
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(edges, axis=2)
    triangles = np.zeros((len(corners), FIELDS))
    triangles[:, :9] = corners.reshape(-1, 9)
    triangles[:, 9:12] = _normals(edges, lengths)
    triangles[:, 12:15] = 1.0 / lengths
    triangles[:, 15] = lengths.max(axis=1)
    return _read_only(
        triangles,
        _enclosing_balls(corners, edges, lengths),
        tree.boxes,
        tree.links,
        tree.moments,
        np.array([0, len(tree.boxes)], dtype=np.int64),
        np.array([volume]),
    )


def joined(parts: Sequence[MeshTables]) -> MeshTables:
    """Join the tables of several meshes."""
    links, roots, nodes, triangles = [], [0], 0, 0
    for part in parts:
        shift = np.array([nodes, triangles, 0], dtype=np.int64)
        links.append((part.links.reshape(-1, LINKS) + shift).ravel())
        nodes += len(part.boxes)
        triangles += len(part.triangles)
        roots.append(nodes)
    return _read_only(
        np.concatenate([part.triangles for part in parts]),
        np.concatenate([part.spheres for part in parts]),
        np.concatenate([part.boxes for part in parts]),
        np.concatenate(links),
        np.concatenate([part.moments for part in parts]),
        np.array(roots, dtype=np.int64),
        np.concatenate([part.volumes for part in parts]),
    )


def _read_only(*arrays: np.ndarray) -> MeshTables:
    for array in arrays:
        array.setflags(write=False)
    return MeshTables(*arrays)


def _normals(edges: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return the unit normals (t, 3), in extended precision; for a triangle without area, any across its edges."""
    wide = edges.astype(np.longdouble)
    longest = lengths.argmax(axis=1)
    rows = np.arange(len(edges))
    # The two shorter edges round least.
    crossed = np.cross(wide[rows, (longest + 1) % 3], wide[rows, (longest + 2) % 3])
    size = np.linalg.norm(crossed, axis=1)
    along = wide[rows, longest] / lengths[rows, longest, None]
    axes = np.eye(3, dtype=np.longdouble)[np.abs(along).argmin(axis=1)]
    flat = size <= 1e-17 * lengths[rows, longest] ** 2
    crossed[flat] = np.cross(along[flat], axes[flat])
    return np.asarray(crossed / np.linalg.norm(crossed, axis=1)[:, None], dtype=np.float64)


def _enclosing_balls(corners: FloatArray, edges: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return the smaller ball (t, 4) around each triangle: about the middle of its longest edge, or its centroid."""
    rows, longest = np.arange(len(corners)), lengths.argmax(axis=1)
    middles = corners[rows, longest] + 0.5 * edges[rows, longest]
    centroids = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    other_reach = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
    best = np.where((reach <= other_reach)[:, None], middles, centroids)
    return np.column_stack([best, 1.000001 * np.minimum(reach, other_reach)])
