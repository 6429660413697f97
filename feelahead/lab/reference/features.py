"""Solids with a point of a chosen face, edge or vertex and the direction out of it, to place spheres exactly.

Two kinds: general, with directions rounded to doubles; and grid-aligned, where every coordinate is a multiple of 1/8
and the directions are whole-number vectors of whole length. On the grid a sphere is tangent exactly, not only to the
last digit.
"""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray

Rng = np.random.Generator

FEATURES = {"face": 3, "edge": 2, "vertex": 1}
"""Number of a tetrahedron's corners that make the feature."""

GRID = 0.125
"""Spacing of the grid, in metres."""

_WHOLE = {
    "face": np.array([(0, 0, 1, 1)]),
    "edge": np.array([(0, 3, 4, 5), (0, 5, 12, 13), (0, 8, 15, 17), (0, 4, 3, 5)]),
    "vertex": np.array([(1, 2, 2, 3), (2, 3, 6, 7), (1, 4, 8, 9), (6, 6, 7, 11), (2, 1, 2, 3)]),
}
"""(x, y, z, length): vectors across each feature with a length in whole numbers."""

_WEIGHTS = {"face": (0.25, 0.25, 0.5), "edge": (0.25, 0.75), "vertex": (1.0,)}
"""Weights of the corners for a point within the feature that stays a short binary number."""


@dataclass(frozen=True)
class Feature:
    """Points on a feature: `points` (p, 3) in m, `steps` (p, 3) outward from the solid, of the `lengths` (p,)."""

    points: FloatArray
    steps: FloatArray
    lengths: FloatArray

    def spheres(self, sizes: FloatArray, depth: float) -> tuple[FloatArray, FloatArray]:
        """Return centres and radii of spheres that reach `depth` radii into the solid; `sizes` (p,) scale the radii."""
        radii = sizes * self.lengths
        return self.points + ((1.0 - depth) * sizes)[:, None] * self.steps, radii


def unit_vectors(rng: Rng, count: int) -> FloatArray:
    """Draw vectors (count, 3), uniform on the unit sphere."""
    vectors = rng.normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def radii(rng: Rng, count: int, *, grid: bool) -> FloatArray:
    """Draw radii (count,) in m, of the order of 1."""
    if grid:
        return np.asarray(rng.integers(1, 25, count) * GRID)
    return np.asarray(np.exp(rng.uniform(np.log(0.3), np.log(3.0), count)))


def points(rng: Rng, *shape: int, grid: bool) -> FloatArray:
    """Draw points (*shape, 3) in m, of the order of 1."""
    values = rng.normal(size=(*shape, 3))
    return np.asarray(np.round(values / GRID) * GRID) if grid else values


def rotations(rng: Rng, count: int, *, grid: bool) -> FloatArray:
    """Draw rotations (count, 3, 3); on the grid, those that permute the axes."""
    if grid:
        columns = rng.permuted(np.tile(np.arange(3), (count, 1)), axis=1)
        return np.asarray(np.eye(3)[columns] * rng.choice((-1.0, 1.0), (count, 3))[:, :, None])
    return np.asarray(np.linalg.qr(rng.normal(size=(count, 3, 3)))[0])


def tetrahedra(rng: Rng, count: int, feature: str, *, grid: bool) -> tuple[FloatArray, Feature]:
    """Draw vertices (count, 4, 3), and a point of the feature that the first 1, 2 or 3 of them make."""
    parts = FEATURES[feature]
    if grid:
        return _grid_tetrahedra(rng, count, feature)
    vertices = rng.normal(size=(count, 4, 3))
    weights = rng.exponential(size=(count, parts))
    on_feature = np.einsum("nv,nvi->ni", weights / weights.sum(axis=1, keepdims=True), vertices[:, :parts])
    # Outward: opposite to the mean direction of the other vertices, less its part along the feature.
    others = vertices[:, parts:] - vertices[:, :1]
    if parts == 3:
        normals = np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0])
        others = normals[:, None] * np.sign(np.einsum("ni,nvi->nv", normals, others))[:, :, None]
    elif parts == 2:
        along = vertices[:, 1] - vertices[:, 0]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        others = others - np.einsum("ni,nvi->nv", along, others)[:, :, None] * along[:, None]
    others /= np.linalg.norm(others, axis=2, keepdims=True)
    away = -others.sum(axis=1)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    return vertices, Feature(on_feature, away, np.ones(count))


def _grid_tetrahedra(rng: Rng, count: int, feature: str) -> tuple[FloatArray, Feature]:
    vertices = rng.integers(-8, 9, (count, 4, 3)).astype(float)
    fixed = {"face": [2], "edge": [1, 2], "vertex": [0, 1, 2]}[feature]
    parts = FEATURES[feature]
    on_feature = vertices[:, :1].copy()
    vertices[:, :parts, fixed] = on_feature[:, :, fixed]
    # The other vertices are strictly on the inner side of the feature's own coordinates.
    inner = on_feature + rng.integers(1, 17, (count, 4 - parts, 3))
    vertices[:, parts:, fixed] = inner[:, :, fixed]
    weights = rng.permuted(np.tile(_WEIGHTS[feature], (count, 1)), axis=1)
    place = np.einsum("nv,nvi->ni", weights, vertices[:, :parts])
    turn, shift = rotations(rng, count, grid=True), rng.integers(-8, 9, (count, 3))
    steps, lengths = _whole_steps(rng, count, feature)
    vertices = GRID * (np.einsum("nij,nvj->nvi", turn, vertices) + shift[:, None])
    place = GRID * (np.einsum("nij,nj->ni", turn, place) + shift)
    return vertices, Feature(place, np.einsum("nij,nj->ni", turn, -steps), lengths)


def boxes(rng: Rng, count: int, feature: str, *, grid: bool) -> tuple[tuple[FloatArray, ...], Feature]:
    """Draw (centres, rotations, half sizes), and a point of a face, edge or vertex of each box."""
    fixed = {"face": [2], "edge": [1, 2], "vertex": [0, 1, 2]}[feature]
    turn, centers = rotations(rng, count, grid=grid), points(rng, count, grid=grid)
    if grid:
        half_sizes = rng.integers(1, 17, (count, 3)) * GRID
        place = np.round(rng.uniform(-0.5, 0.5, (count, 3)) * half_sizes / GRID) * GRID
        steps, lengths = _whole_steps(rng, count, feature)
    else:
        half_sizes = rng.uniform(0.2, 1.5, (count, 3))
        place = rng.uniform(-1.0, 1.0, (count, 3)) * half_sizes
        steps = np.zeros((count, 3))
        steps[:, fixed] = rng.uniform(0.2, 1.0, (count, len(fixed)))
        steps /= np.linalg.norm(steps, axis=1, keepdims=True)
        lengths = np.ones(count)
    sides = rng.choice((-1.0, 1.0), (count, 3))
    place[:, fixed] = (sides * half_sizes)[:, fixed]
    to_world = np.einsum("nij,nj->ni", turn, place)
    feature_points = Feature(centers + to_world, np.einsum("nij,nj->ni", turn, sides * steps), lengths)
    return (centers, turn, np.asarray(half_sizes, float)), feature_points


def _whole_steps(rng: Rng, count: int, feature: str) -> tuple[FloatArray, FloatArray]:
    chosen = _WHOLE[feature][rng.integers(0, len(_WHOLE[feature]), count)].astype(float)
    return chosen[:, :3], chosen[:, 3]
