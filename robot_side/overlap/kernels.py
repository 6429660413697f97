"""Overlaps of (sphere, primitive) pairs in contiguous arrays, for calls in a tick.

The caller guarantees equal numbers of rows, finite values, radii >= 0, rotations that are orthonormal to 1e-6, and
normals other than 0. With `trusted=False` the values are checked, except the numbers of rows: a wrong value raises
`DoubtfulNumbersError`, and so may a value just within its limits. Unlike the functions of `robot_side.overlap`, the
error does not name the argument. Arrays are float64 and C-contiguous, lengths in m; any other type or layout raises
TypeError. Each function returns new arrays (volumes (p,) in m³, gradients (p, 3) = dV/dcentre in m², areas (p,) =
dV/dradius in m²).

For boxes and tetrahedra there are three methods. Bounds settle most pairs in which the surfaces do not cut. Vectorised
loops compute the others. The precise forms recompute the few for which doubles do not suffice (see `lane_result`).
"""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import BOOL, Compiled, compiled, inlined, input_array, output_array
from robot_side.compiled.vectors import load
from robot_side.overlap.box_batch import overlap_boxes
from robot_side.overlap.checks.arguments import LARGEST, SMALLEST_NORMAL
from robot_side.overlap.lanes import reach
from robot_side.overlap.precise.kernels import precise_boxes, precise_tetrahedra
from robot_side.overlap.solids.ball import sphere_overlap
from robot_side.overlap.solids.half_space import half_space_overlap
from robot_side.overlap.solids.solid import Overlap, Overlaps
from robot_side.overlap.tetrahedron_batch import overlap_tetrahedra

_RESULTS = output_array(1), output_array(2), output_array(1)


class DoubtfulNumbersError(ValueError):
    """Error with `trusted=False`: some number may be out of range or NaN."""


def sphere_pairs(
    centers: FloatArray, radii: FloatArray, other_centers: FloatArray, other_radii: FloatArray, *, trusted: bool = True
) -> Overlaps:
    """Return overlaps of spheres `centers` (p, 3), `radii` (p,) with the spheres `other_centers`, `other_radii`."""
    return _one_by_one(_sphere_loop, (centers, radii, other_centers, other_radii), trusted)


def half_space_pairs(
    centers: FloatArray, radii: FloatArray, normals: FloatArray, offsets: FloatArray, *, trusted: bool = True
) -> Overlaps:
    """Return overlaps of spheres `centers` (p, 3), `radii` (p,) with the half-spaces normal · x <= offset.

    normals (p, 3), offsets (p,).
    """
    return _one_by_one(_half_space_loop, (centers, radii, normals, offsets), trusted)


def _one_by_one(loop: Compiled, arguments: tuple[FloatArray, ...], trusted: bool) -> Overlaps:
    total = len(arguments[1])
    results = np.empty(total), np.empty((total, 3)), np.empty(total)
    if not loop(*arguments, *results) and not trusted:
        raise DoubtfulNumbersError
    return results


def box_pairs(
    centers: FloatArray,
    radii: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    *,
    trusted: bool = True,
) -> Overlaps:
    """Return overlaps of spheres `centers` (p, 3), `radii` (p,) with boxes.

    box_centers (p, 3), box_rotations (p, 3, 3) from the box's frame to the spheres', box_half_sizes (p, 3).
    """
    arguments = centers, radii, box_centers, box_rotations, box_half_sizes
    return _many(overlap_boxes, precise_boxes, arguments, trusted)


def tetrahedron_pairs(
    centers: FloatArray,
    radii: FloatArray,
    vertices: FloatArray,
    *,
    trusted: bool = True,
) -> Overlaps:
    """Return overlaps of spheres `centers` (p, 3), `radii` (p,) with tetrahedra.

    vertices (p, 4, 3): each tetrahedron's corners in any order.
    """
    return _many(overlap_tetrahedra, precise_tetrahedra, (centers, radii, vertices), trusted)


def _many(overlap: Compiled, precise: Compiled, arguments: tuple[FloatArray, ...], trusted: bool) -> Overlaps:
    total = len(arguments[1])
    # The kernels do not write the results of pairs without contact.
    results = np.zeros(total), np.zeros((total, 3)), np.zeros(total)
    rows: IntArray = np.empty(total + 1, dtype=np.int64)
    unsettled = overlap(*arguments, *results, rows)
    if rows.item(-1) < 0 and not trusted:
        raise DoubtfulNumbersError
    if unsettled:
        precise(*arguments, rows[:unsettled], *results)
    return results


@inlined
def _store(pair: int, overlap: Overlap, volumes: FloatArray, gradients: FloatArray, areas: FloatArray) -> None:
    volumes[pair] = overlap[0]
    gradients[pair, 0] = overlap[1][0]
    gradients[pair, 1] = overlap[1][1]
    gradients[pair, 2] = overlap[1][2]
    areas[pair] = overlap[2]


@compiled(input_array(2), input_array(1), input_array(2), input_array(1), *_RESULTS, returns=BOOL)
def _sphere_loop(
    centers: FloatArray,
    radii: FloatArray,
    other_centers: FloatArray,
    other_radii: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> bool:
    sure = True
    for pair in range(radii.size):
        center, radius = load(centers, pair), radii[pair]
        other, other_radius = load(other_centers, pair), other_radii[pair]
        _store(pair, sphere_overlap(center, radius, other, other_radius), volumes, gradients, areas)
        lengths = (radius >= 0.0) & (other_radius >= 0.0)
        sure &= lengths & (reach(center) + radius + reach(other) + other_radius <= LARGEST)
    return sure


@compiled(input_array(2), input_array(1), input_array(2), input_array(1), *_RESULTS, returns=BOOL)
def _half_space_loop(
    centers: FloatArray,
    radii: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> bool:
    sure = True
    for pair in range(radii.size):
        center, radius, normal, offset = load(centers, pair), radii[pair], load(normals, pair), offsets[pair]
        _store(pair, half_space_overlap(center, radius, normal, offset), volumes, gradients, areas)
        lengths = (radius >= 0.0) & (reach(normal) > 2.0 * SMALLEST_NORMAL)
        sure &= lengths & (reach(center) + radius + reach(normal) + abs(offset) <= LARGEST)
    return sure
