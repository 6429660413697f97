"""Tables for the mesh kernels, of one or several meshes: the triangles in the order of their tree, and the tree."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.overlap.meshes.triangle_tree import LINKS, build_tree

FIELDS = 16
"""How many numbers describe one triangle in `MeshTables.triangles`"""


class MeshTables(NamedTuple):
    """Flat arrays of m meshes with t triangles and n nodes in all; lengths in m."""

    triangles: FloatArray
    """(t, 16) for each triangle: corners (9), outward unit normal (3), 1 / length of each edge from corner i to i + 1
    (3), length of the longest edge (1)"""
    spheres: FloatArray
    """(t, 4) centre and radius of a ball around each triangle"""
    boxes: FloatArray
    """(n, 6) box of each node, as in `TriangleTree`"""
    links: IntArray
    """(3 n,) links of each node, as in `TriangleTree`, but with indices into the arrays of all meshes"""
    moments: FloatArray
    """(n, 7) moments of each node, as in `TriangleTree`"""
    roots: IntArray
    """(m + 1,) root node of each mesh, followed by n"""
    volumes: FloatArray
    """(m,) volume of each mesh (m³)"""

    def room(self) -> IntArray:
        """Return uninitialised scratch (t + 1,) for the numbers of the triangles near a sphere, and one more."""
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
    """Return the tables of several meshes joined into one."""
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
    """Return the triangles' unit normals (t, 3), computed in extended precision.

    A triangle without area gets any unit vector at right angles to its longest edge.
    """
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
    """Return a ball (t, 4) around each triangle, about the middle of its longest edge or about its centroid.

    The smaller one is taken, enlarged by a millionth.
    """
    rows, longest = np.arange(len(corners)), lengths.argmax(axis=1)
    middles = corners[rows, longest] + 0.5 * edges[rows, longest]
    centroids = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    other_reach = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
    best = np.where((reach <= other_reach)[:, None], middles, centroids)
    return np.column_stack([best, 1.000001 * np.minimum(reach, other_reach)])
