"""Overlaps of (sphere, primitive) pairs in contiguous arrays: what a 1 kHz tick calls.

Nothing is validated here: the caller vouches for finite values, radii >= 0, rotations that are orthonormal to
1e-6, normals other than 0 and equal numbers of rows. Arrays are float64 and C-contiguous, lengths in m; any
other type or layout raises TypeError. Each function returns (volumes (p,) in m³, gradients (p, 3) = dV/dcentre
in m², areas (p,) = dV/dradius in m²) in new arrays. `robot_side.overlap` has the functions that check.
"""

import numpy as np

from common.arrays import FloatArray
from common.clock import MonotonicClock
from robot_side.overlap.ball import sphere_overlap
from robot_side.overlap.box import box_overlap
from robot_side.overlap.compile import compiled, imported_kernels, inlined, input_array, output_array
from robot_side.overlap.half_space import half_space_overlap
from robot_side.overlap.solid import Overlap
from robot_side.overlap.tetrahedron import tetrahedron_overlap
from robot_side.overlap.vectors import load, scale

Overlaps = tuple[FloatArray, FloatArray, FloatArray]
"""(volumes (p,), gradients (p, 3), areas (p,))."""

_RESULTS = output_array(1), output_array(2), output_array(1)


def sphere_pairs(
    centers: FloatArray, radii: FloatArray, other_centers: FloatArray, other_radii: FloatArray
) -> Overlaps:
    """Spheres `centers` (p, 3), `radii` (p,) with spheres `other_centers` (p, 3), `other_radii` (p,)."""
    results = _empty(len(radii))
    _sphere_loop(centers, radii, other_centers, other_radii, *results)
    return results


def half_space_pairs(centers: FloatArray, radii: FloatArray, normals: FloatArray, offsets: FloatArray) -> Overlaps:
    """Spheres `centers` (p, 3), `radii` (p,) with half-spaces normals (p, 3)·x <= offsets (p,)."""
    results = _empty(len(radii))
    _half_space_loop(centers, radii, normals, offsets, *results)
    return results


def box_pairs(
    centers: FloatArray,
    radii: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
) -> Overlaps:
    """Spheres with boxes `box_centers` (p, 3), `box_rotations` (p, 3, 3) to world, `box_half_sizes` (p, 3)."""
    results = _empty(len(radii))
    _box_loop(centers, radii, box_centers, box_rotations, box_half_sizes, *results)
    return results


def tetrahedron_pairs(centers: FloatArray, radii: FloatArray, vertices: FloatArray) -> Overlaps:
    """Spheres `centers` (p, 3), `radii` (p,) with tetrahedra `vertices` (p, 4, 3), in any order."""
    results = _empty(len(radii))
    _tetrahedron_loop(centers, radii, vertices, *results)
    return results


def warm_up() -> float:
    """Compile every kernel of the imported modules, or load it from the cache on disk; how long that took (s).

    These run once, too. Without it the first call of each kernel does so, which takes up to seconds.
    """
    clock = MonotonicClock()
    start_s = clock.now()
    for kernel in imported_kernels():
        kernel.prepare()
    center, radius = np.zeros((1, 3)), np.ones(1)
    sphere_pairs(center, radius, center, radius)
    half_space_pairs(center, radius, np.array([[0.0, 0.0, 1.0]]), np.zeros(1))
    box_pairs(center, radius, center, np.eye(3)[None], np.ones((1, 3)))
    tetrahedron_pairs(center, radius, np.array([[[0.0, 0.0, 0.0], *np.eye(3)]]))
    return clock.now() - start_s


def _empty(count: int) -> Overlaps:
    return np.empty(count), np.empty((count, 3)), np.empty(count)


@inlined
def _store(pair: int, overlap: Overlap, volumes: FloatArray, gradients: FloatArray, areas: FloatArray) -> None:
    volumes[pair] = overlap[0]
    gradients[pair, 0] = overlap[1][0]
    gradients[pair, 1] = overlap[1][1]
    gradients[pair, 2] = overlap[1][2]
    areas[pair] = overlap[2]


@compiled(input_array(2), input_array(1), input_array(2), input_array(1), *_RESULTS)
def _sphere_loop(
    centers: FloatArray,
    radii: FloatArray,
    other_centers: FloatArray,
    other_radii: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> None:
    for pair in range(radii.size):
        overlap = sphere_overlap(load(centers, pair), radii[pair], load(other_centers, pair), other_radii[pair])
        _store(pair, overlap, volumes, gradients, areas)


@compiled(input_array(2), input_array(1), input_array(2), input_array(1), *_RESULTS)
def _half_space_loop(
    centers: FloatArray,
    radii: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> None:
    for pair in range(radii.size):
        overlap = half_space_overlap(load(centers, pair), radii[pair], load(normals, pair), offsets[pair])
        _store(pair, overlap, volumes, gradients, areas)


@compiled(input_array(2), input_array(1), input_array(2), input_array(3), input_array(2), *_RESULTS)
def _box_loop(
    centers: FloatArray,
    radii: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> None:
    for pair in range(radii.size):
        to_world = box_rotations[pair].T
        half_edges = (
            scale(box_half_sizes[pair, 0], load(to_world, 0)),
            scale(box_half_sizes[pair, 1], load(to_world, 1)),
            scale(box_half_sizes[pair, 2], load(to_world, 2)),
        )
        overlap = box_overlap(load(centers, pair), radii[pair], load(box_centers, pair), half_edges)
        _store(pair, overlap, volumes, gradients, areas)


@compiled(input_array(2), input_array(1), input_array(3), *_RESULTS)
def _tetrahedron_loop(
    centers: FloatArray,
    radii: FloatArray,
    vertices: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> None:
    for pair in range(radii.size):
        corners = (
            load(vertices[pair], 0),
            load(vertices[pair], 1),
            load(vertices[pair], 2),
            load(vertices[pair], 3),
        )
        overlap = tetrahedron_overlap(load(centers, pair), radii[pair], corners)
        _store(pair, overlap, volumes, gradients, areas)
