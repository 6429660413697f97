"""Bounding volume hierarchy: a tree of boxes over a mesh's triangles, in flat arrays that are walked without a stack.

The nodes are in depth-first order, so a node's first child follows it directly. To skip a node with all descendants,
the walk goes on at its escape index, the number of the node after its last descendant. The triangles are in the order
of the leaves.
"""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray, IntArray

LEAF_TRIANGLES = 10
"""Maximum number of triangles in a leaf"""

LINKS = 3
"""How many numbers describe one node in `TriangleTree.links`"""


@dataclass(frozen=True)
class TriangleTree:
    """Boxes, links and moments of n nodes over t triangles."""

    order: IntArray
    """(t,) numbers of the triangles, in the order of the leaves"""
    boxes: FloatArray
    """(n, 6) bounding box of each node: lowest, then highest coordinates (m)"""
    links: IntArray
    """(3 n,) for each node its escape index, its first triangle, and its number of triangles (0 if it has children)"""
    moments: FloatArray
    """(n, 7) for each node the centroid weighted by area (m), the sum of area times outward normal (m²), and the radius
    about the centroid that contains all corners (m)"""


def build_tree(corners: FloatArray) -> TriangleTree:
    """Build the tree over triangles `corners` (t, 3, 3).

    A node is halved at the median of its triangles' centroids, along the axis on which these are spread most.
    """
    middles, parts = corners.mean(axis=1), []
    boxes: list[FloatArray] = []
    links: list[tuple[int, int, int]] = []
    moments: list[FloatArray] = []
    area_vectors = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(area_vectors, axis=1)
    placed = 0

    def add(members: IntArray) -> None:
        nonlocal placed
        node = len(boxes)
        points = corners[members].reshape(-1, 3)
        boxes.append(np.concatenate([points.min(axis=0), points.max(axis=0)]))
        total = areas[members].sum()
        weights = areas[members] / total if total > 0.0 else np.full(len(members), 1.0 / len(members))
        centroid = weights @ middles[members]
        reach = np.linalg.norm(points - centroid, axis=1).max()
        moments.append(np.concatenate([centroid, area_vectors[members].sum(axis=0), [reach]]))
        links.append((0, placed, 0))
        if len(members) <= LEAF_TRIANGLES:
            parts.append(members)
            placed += len(members)
            links[node] = len(boxes), placed - len(members), len(members)
            return
        spread = np.ptp(middles[members], axis=0)
        half = len(members) // 2
        sides = np.argpartition(middles[members, int(spread.argmax())], half)
        add(members[sides[:half]])
        add(members[sides[half:]])
        links[node] = len(boxes), links[node][1], 0

    add(np.arange(len(corners)))
    return TriangleTree(
        np.concatenate(parts), np.array(boxes), np.array(links, dtype=np.int64).ravel(), np.array(moments)
    )
