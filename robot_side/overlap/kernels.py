"""Overlaps of (sphere, primitive) pairs in contiguous arrays: what a 1 kHz tick calls.

Nothing is validated here: the caller vouches for finite values, radii >= 0, rotations that are orthonormal to
1e-6, normals other than 0 and equal numbers of rows. Arrays are float64 and C-contiguous, lengths in m; any
other type or layout raises TypeError. Each function returns (volumes (p,) in m³, gradients (p, 3) = dV/dcentre
in m², areas (p,) = dV/dradius in m²) in new arrays. `robot_side.overlap` has the functions that check.

Boxes and tetrahedra go three ways: bounds settle most pairs that do not cut, vector lanes work out the others, and
the few for which doubles do not suffice (see `lane_result`) are worked out once more by the precise forms.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import Compiled, compiled, inlined, input_array, output_array
from robot_side.compiled.vectors import load
from robot_side.overlap.closed_forms.ball import sphere_overlap
from robot_side.overlap.closed_forms.half_space import half_space_overlap
from robot_side.overlap.closed_forms.solid import Overlap, Overlaps
from robot_side.overlap.lanes.box_batch import overlap_boxes
from robot_side.overlap.lanes.tetrahedron_batch import overlap_tetrahedra
from robot_side.overlap.precise.kernels import precise_boxes, precise_tetrahedra

PAIRS_PER_THREAD = 8192
"""A thread is worth starting for so many boxes or tetrahedra, nearly a millisecond of work."""

_RESULTS = output_array(1), output_array(2), output_array(1)


@dataclass
class PairCounts:
    """How many pairs of spheres with boxes or tetrahedra went which way; calls add to it."""

    pairs: int = 0
    early: int = 0
    """settled by bounds alone"""
    precise: int = 0
    """worked out by the precise forms"""


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
    *,
    counts: PairCounts | None = None,
    threads: int | None = None,
) -> Overlaps:
    """Spheres with boxes `box_centers` (p, 3), `box_rotations` (p, 3, 3) to world, `box_half_sizes` (p, 3).

    `threads` None takes as many as pay.
    """
    arguments = centers, radii, box_centers, box_rotations, box_half_sizes
    return _many(overlap_boxes, precise_boxes, arguments, counts, threads)


def tetrahedron_pairs(
    centers: FloatArray,
    radii: FloatArray,
    vertices: FloatArray,
    *,
    counts: PairCounts | None = None,
    threads: int | None = None,
) -> Overlaps:
    """Spheres `centers` (p, 3), `radii` (p,) with tetrahedra `vertices` (p, 4, 3), in any order.

    `threads` None takes as many as pay.
    """
    return _many(overlap_tetrahedra, precise_tetrahedra, (centers, radii, vertices), counts, threads)


def _many(
    overlap: Compiled,
    precise: Compiled,
    arguments: tuple[FloatArray, ...],
    counts: PairCounts | None,
    threads: int | None,
) -> Overlaps:
    total = len(arguments[1])
    # The kernels leave pairs without contact alone.
    results = np.zeros(total), np.zeros((total, 3)), np.zeros(total)
    if threads is None:
        threads = min(total // PAIRS_PER_THREAD, os.cpu_count() or 1) if total >= 2 * PAIRS_PER_THREAD else 1
    if threads <= 1:
        parts = [_part(overlap, precise, arguments, results)]
    else:
        ends = np.linspace(0, total, threads + 1).astype(int).tolist()

        def part_of(first: int, last: int) -> tuple[int, int]:
            rows = slice(first, last)
            own = results[0][rows], results[1][rows], results[2][rows]
            return _part(overlap, precise, tuple(argument[rows] for argument in arguments), own)

        try:
            shared = _pool().map(part_of, ends[:-1], ends[1:])
        except RuntimeError:
            # The interpreter is ending, and starts no threads any more.
            shared = map(part_of, ends[:-1], ends[1:])
        parts = list(shared)
    if counts is not None:
        counts.pairs += total
        counts.early += total - sum(partial for partial, _ in parts)
        counts.precise += sum(unsettled for _, unsettled in parts)
    return results


def _part(
    overlap: Compiled, precise: Compiled, arguments: tuple[FloatArray, ...], results: Overlaps
) -> tuple[int, int]:
    """Fill in `results`; how many pairs bounds did not settle, and how many took the precise forms."""
    rows: IntArray = np.empty(len(arguments[1]) + 1, dtype=np.int64)
    unsettled = overlap(*arguments, *results, rows)
    if unsettled:
        precise(*arguments, rows[:unsettled], *results)
    return int(rows[-1]), unsettled


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="overlap")


# A forked process has none of the threads, and would wait for them for ever.
os.register_at_fork(after_in_child=_pool.cache_clear)


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
