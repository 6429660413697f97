"""What people use instead of exact overlaps: points in the ball, a grid of voxels, numerical quadrature.

Each takes `Pairs` of tetrahedra or boxes and returns volumes (p,) in m³. They see a solid as the half-spaces of
its faces, so that all are given the same.
"""

import math
import warnings
from itertools import product

import numpy as np
from scipy import integrate

from common.arrays import BoolArray, FloatArray
from feelahead.benchmarks.overlap.pairs import BOX_QUADRILATERALS, TETRAHEDRON_TRIANGLES, Pairs

SATELLITES = 29
_CHUNK = 1 << 16
"""Points at a time, so that they stay within the processor's cache."""


def face_planes(pairs: Pairs) -> tuple[FloatArray, FloatArray]:
    """Outward normals (p, f, 3) and heights (p, f) of the face planes above the sphere's centre, in m.

    Nothing is below the planes of a solid without volume: their heights are -inf.
    """
    faces = TETRAHEDRON_TRIANGLES if pairs.solid == "tetrahedron" else BOX_QUADRILATERALS
    corners = pairs.corners - pairs.centers[:, None]
    rings = corners[:, np.array([face[:3] for face in faces])]
    normals = np.cross(rings[:, :, 1] - rings[:, :, 0], rings[:, :, 2] - rings[:, :, 0])
    lengths = np.linalg.norm(normals, axis=2, keepdims=True)
    normals = normals / np.where(lengths == 0.0, 1.0, lengths)
    edges = corners[:, 1:] - corners[:, :1] if pairs.solid == "tetrahedron" else pairs.parameters[1]
    handedness = np.sign(np.linalg.det(edges))
    normals = normals * handedness[:, None, None]
    heights = np.einsum("nfi,nfi->nf", normals, rings[:, :, 0])
    heights[(handedness == 0.0) | (pairs.solid_volumes == 0.0)] = -np.inf
    return normals, heights


def satellite_points() -> FloatArray:
    """(29, 3) in radii: the centre and two shells of 14 points, each standing for the same volume.

    As in the divided void fraction of CFDEMcoupling (Goniva et al. 2012): the shells end at the radii that hold
    1, 15 and 29 parts of 29 of the ball, and the points lie at a shell's mean radius along the axes and
    diagonals of a cube.
    """
    axes = [sign * row for row in np.eye(3) for sign in (1.0, -1.0)]
    diagonals = [np.array(signs) / math.sqrt(3.0) for signs in product((1.0, -1.0), repeat=3)]
    inner, middle = (1.0 / SATELLITES) ** (1.0 / 3.0), (15.0 / SATELLITES) ** (1.0 / 3.0)
    shells = [0.75 * (outer**4 - start**4) / (outer**3 - start**3) for start, outer in ((inner, middle), (middle, 1.0))]
    return np.array([np.zeros(3), *(radius * point for radius in shells for point in (*axes, *diagonals))])


def satellites(pairs: Pairs) -> FloatArray:
    """The share of 29 satellite points that lie within the solid, all pairs at once."""
    return _shares(pairs, satellite_points()) * pairs.sphere_volumes


def monte_carlo(pairs: Pairs, points: int) -> FloatArray:
    """The share of `points` uniform random points of the ball that lie within the solid."""
    rng = np.random.default_rng(points)
    directions = rng.normal(size=(points, 3))
    directions *= (np.cbrt(rng.random(points)) / np.linalg.norm(directions, axis=1))[:, None]
    return _one_by_one(pairs, directions) * pairs.sphere_volumes


def voxels(pairs: Pairs, cells: int) -> FloatArray:
    """The share of the ball's cube, in cells³ voxels, whose voxel centres lie within both."""
    ticks = (np.arange(cells) + 0.5) * 2.0 / cells - 1.0
    grid = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    within = grid[np.einsum("ni,ni->n", grid, grid) <= 1.0]
    return _one_by_one(pairs, within) * len(within) * (2.0 * pairs.radii / cells) ** 3


def quadrature(pairs: Pairs, tolerance: float) -> FloatArray:
    """SciPy's `dblquad` over the disc below the ball of the length of each vertical chord within the solid.

    `tolerance` is its absolute one, as a share of the sphere's volume.
    """
    normals, heights = face_planes(pairs)
    with warnings.catch_warnings():
        # Chord lengths have kinks, at which it complains of slow convergence.
        warnings.simplefilter("ignore", integrate.IntegrationWarning)
        return np.array(
            [
                integrate.dblquad(
                    _chord, -1.0, 1.0, _low, _high, (n, h / radius), epsabs=tolerance * 4.0 / 3.0 * math.pi, epsrel=0.0
                )[0]
                * radius**3
                for n, h, radius in zip(normals, heights, pairs.radii, strict=True)
            ]
        )


def _low(x: float) -> float:
    return -math.sqrt(max(1.0 - x * x, 0.0))


def _high(x: float) -> float:
    return math.sqrt(max(1.0 - x * x, 0.0))


def _chord(y: float, x: float, normals: FloatArray, heights: FloatArray) -> float:
    """The length of the part of the unit ball's vertical chord at (x, y) that lies within every half-space."""
    high = math.sqrt(max(1.0 - x * x - y * y, 0.0))
    low = -high
    for (a, b, c), height in zip(normals.tolist(), heights.tolist(), strict=True):
        rest = height - a * x - b * y
        if c > 0.0:
            high = min(high, rest / c)
        elif c < 0.0:
            low = max(low, rest / c)
        elif rest < 0.0:
            return 0.0
    return max(high - low, 0.0)


def _shares(pairs: Pairs, points: FloatArray) -> FloatArray:
    """The share of the points (k, 3), in radii from each centre, within each solid; for few points."""
    normals, heights = face_planes(pairs)
    above = np.einsum("nfi,ki->nfk", normals, points) * pairs.radii[:, None, None] > heights[:, :, None]
    return np.asarray(np.mean(~above.any(axis=1), axis=1))


def _one_by_one(pairs: Pairs, points: FloatArray) -> FloatArray:
    """The same for many points, one pair at a time."""
    normals, heights = face_planes(pairs)
    shares = np.zeros(len(pairs))
    for row, radius in enumerate(pairs.radii):
        found = 0
        for start in range(0, len(points), _CHUNK):
            found += int(np.count_nonzero(_within(points[start : start + _CHUNK], normals[row], heights[row] / radius)))
        shares[row] = found / len(points)
    return shares


def _within(points: FloatArray, normals: FloatArray, heights: FloatArray) -> BoolArray:
    return np.asarray((points @ normals.T <= heights).all(axis=1))
