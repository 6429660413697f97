"""Common approximations of an overlap: the share of points of the ball that lie within the solid.

Each method takes `Pairs` of tetrahedra or boxes and returns volumes (p,) in m³. A solid is given by the half-spaces of
its faces.
"""

import math
from collections.abc import Callable
from functools import partial
from itertools import product

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.reference.pairs import BOX_QUADRILATERALS, TETRAHEDRON_TRIANGLES, Pairs

_CHUNK = 1 << 16
"""Number of points that are handled at a time, so that they fit in the processor's cache."""


def satellite_points() -> FloatArray:
    """Return points (29, 3) in radii: the centre and two shells of 14 points, each with the same share of the volume.

    They are those of the divided void fraction in CFDEMcoupling (Goniva et al. 2012). The shells end at the radii that
    hold 1, 15 and 29 parts of 29 of the ball. The points lie at a shell's mean radius, along the axes and diagonals of
    a cube.
    """
    axes = [sign * row for row in np.eye(3) for sign in (1.0, -1.0)]
    diagonals = [np.array(signs) / math.sqrt(3.0) for signs in product((1.0, -1.0), repeat=3)]
    ends = [(part / 29.0) ** (1.0 / 3.0) for part in (1, 15, 29)]
    shells = [0.75 * (end**4 - start**4) / (end**3 - start**3) for start, end in ((ends[0], ends[1]), ends[1:])]
    return np.array([np.zeros(3), *(radius * point for radius in shells for point in (*axes, *diagonals))])


def satellites(pairs: Pairs) -> FloatArray:
    """Approximate by the share of 29 satellite points within the solid."""
    return _shares(pairs, satellite_points()) * pairs.sphere_volumes


def monte_carlo(pairs: Pairs, points: int) -> FloatArray:
    """Approximate by the share of `points` uniform random points of the ball within the solid."""
    rng = np.random.default_rng(points)
    directions = rng.normal(size=(points, 3))
    directions *= (np.cbrt(rng.random(points)) / np.linalg.norm(directions, axis=1))[:, None]
    return _shares(pairs, directions) * pairs.sphere_volumes


def voxels(pairs: Pairs, edge: float) -> FloatArray:
    """Approximate by the voxels of edge `edge`, in radii, whose middles lie within ball and solid."""
    middles = edge * (np.arange(-math.ceil(1.0 / edge), math.ceil(1.0 / edge)) + 0.5)
    points = np.stack(np.meshgrid(middles, middles, middles), axis=-1).reshape(-1, 3)
    points = points[(points**2).sum(axis=1) <= 1.0]
    counted: FloatArray = _shares(pairs, points) * len(points) * (edge * pairs.radii) ** 3
    return counted


SLOW: dict[str, Callable[[Pairs], FloatArray]] = {
    f"Monte Carlo 1e{power}": partial(monte_carlo, points=10**power) for power in (3, 4, 5)
}
"""Methods that take long, by name"""


def _face_planes(pairs: Pairs) -> tuple[FloatArray, FloatArray]:
    """Return outward normals (p, f, 3) and heights (p, f) of the face planes above the sphere's centre, in m.

    For a solid without volume the heights are -inf, so that no point counts as within it.
    """
    faces = TETRAHEDRON_TRIANGLES if pairs.solid == "tetrahedron" else BOX_QUADRILATERALS
    corners = pairs.corners - pairs.centers[:, None]
    rings = corners[:, np.array([face[:3] for face in faces])]
    normals = np.cross(rings[:, :, 1] - rings[:, :, 0], rings[:, :, 2] - rings[:, :, 0])
    lengths = np.linalg.norm(normals, axis=2, keepdims=True)
    edges = corners[:, 1:] - corners[:, :1] if pairs.solid == "tetrahedron" else pairs.parameters[1]
    handedness = np.sign(np.linalg.det(edges))
    normals = normals / np.where(lengths == 0.0, 1.0, lengths) * handedness[:, None, None]
    heights = np.einsum("nfi,nfi->nf", normals, rings[:, :, 0])
    heights[(handedness == 0.0) | (pairs.solid_volumes == 0.0)] = -np.inf
    return normals, heights


def _shares(pairs: Pairs, points: FloatArray) -> FloatArray:
    """Return the share of the points (k, 3), in radii from each centre, within each solid."""
    normals, heights = _face_planes(pairs)
    heights = heights / pairs.radii[:, None]
    found, at_once = np.zeros(len(pairs)), max(1, _CHUNK // len(points))
    for first in range(0, len(pairs), at_once):
        rows = slice(first, first + at_once)
        for start in range(0, len(points), _CHUNK):
            heights_of_points = np.einsum("nfi,ki->nkf", normals[rows], points[start : start + _CHUNK])
            found[rows] += (heights_of_points <= heights[rows, None]).all(axis=2).sum(axis=1)
    return found / len(points)
