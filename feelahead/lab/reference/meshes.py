"""A closed mesh that is not convex (a torus), with which the mesh kernels' run time is measured."""

import numpy as np

from common.arrays import FloatArray, IntArray

TORUS = (1.0, 0.35)
"""Radii of the torus, of its ring and of its tube, in m."""


def torus(around: int, across: int) -> tuple[FloatArray, IntArray]:
    """Make a torus, which is not convex: vertices (around · across, 3) in m, triangles (2 · around · across, 3)."""
    turn, tilt = np.meshgrid(
        2.0 * np.pi * np.arange(around) / around, 2.0 * np.pi * np.arange(across) / across, indexing="ij"
    )
    ring, tube = TORUS
    reach = ring + tube * np.cos(tilt)
    vertices = np.stack([reach * np.cos(turn), reach * np.sin(turn), tube * np.sin(tilt)], axis=-1).reshape(-1, 3)
    number = np.arange(around * across).reshape(around, across)
    right, up = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
    corner = np.roll(right, -1, axis=1)
    halves = [np.stack(three, axis=-1).reshape(-1, 3) for three in ((number, right, corner), (number, corner, up))]
    return vertices, np.concatenate(halves).astype(np.int64)


def around_torus(rng: np.random.Generator, count: int, radius: float) -> FloatArray:
    """Draw centres (count, 3) of spheres at random depths around the surface of a torus."""
    turn, tilt = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    reach = TORUS[1] + radius * rng.uniform(-0.8, 0.8, count)
    flat = TORUS[0] + reach * np.cos(tilt)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), reach * np.sin(tilt)], axis=-1)
