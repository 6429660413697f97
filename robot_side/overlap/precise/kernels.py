"""Overlaps for which float64 has too few digits: tiny ones, and those of solids much larger or smaller than the sphere.

Arguments are not checked, as in `kernels`. Each function overwrites the results of the pairs whose numbers are in
`rows`.
"""

import math

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import compiled, inlined, input_array, input_indices, output_array
from robot_side.compiled.stack import on_stack
from robot_side.compiled.vectors import Vector, dot
from robot_side.overlap.digits.double_double import two_product, two_sum
from robot_side.overlap.digits.double_double_vectors import (
    PreciseVector,
    highs,
    load_vector,
    precise_add,
    store_vector,
)
from robot_side.overlap.digits.expansion import determinant
from robot_side.overlap.precise.features import BOX, DIRECTIONS, ENDS, POINTS, ROWS, STARTS, TETRAHEDRON
from robot_side.overlap.precise.polyhedron import polyhedron_overlap
from robot_side.overlap.solids.solid import Overlap

LARGEST_REACH = 1e3
"""Distance from the sphere's centre, in radii, at which boxes are cut off"""

_features = on_stack(ROWS, 3, 2)
_RESULTS = output_array(1), output_array(2), output_array(1)


@compiled(input_array(2), input_array(1), input_array(3), input_indices(), *_RESULTS)
def precise_tetrahedra(
    centers: FloatArray,
    radii: FloatArray,
    vertices: FloatArray,
    rows: IntArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> None:
    """Fill overlaps of spheres with tetrahedra, for the pairs `rows` (k,).

    centers (p, 3), radii (p,), vertices (p, 4, 3): each tetrahedron's corners in any order.
    """
    features = _features()
    for index in range(rows.size):
        pair = rows[index]
        radius, scale = _scaled_radius(radii[pair])
        for corner in range(4):
            for axis in range(3):
                difference = two_sum(scale * vertices[pair, corner, axis], -scale * centers[pair, axis])
                features[POINTS + corner, axis, 0], features[POINTS + corner, axis, 1] = difference
            store_vector(features, DIRECTIONS + corner, _side(vertices, pair, corner, scale))
        a, b = load_vector(features, DIRECTIONS + 1), load_vector(features, DIRECTIONS + 2)
        volume_6 = determinant(a, b, load_vector(features, DIRECTIONS + 3))
        if volume_6 < 0.0:
            third = load_vector(features, POINTS + 2)
            store_vector(features, POINTS + 2, load_vector(features, POINTS + 3))
            store_vector(features, POINTS + 3, third)
        overlap = polyhedron_overlap(features, TETRAHEDRON, radius, abs(volume_6) / 6.0)
        _store(pair, overlap, 1.0 / scale, volumes, gradients, areas)


@compiled(input_array(2), input_array(1), input_array(2), input_array(3), input_array(2), input_indices(), *_RESULTS)
def precise_boxes(
    centers: FloatArray,
    radii: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    rows: IntArray,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
) -> None:
    """Fill overlaps of spheres with boxes, for the pairs `rows` (k,).

    centers (p, 3), radii (p,), box_centers (p, 3), box_rotations (p, 3, 3), box_half_sizes (p, 3).
    """
    features = _features()
    for index in range(rows.size):
        pair = rows[index]
        radius, scale = _scaled_radius(radii[pair])
        middle = (
            two_sum(scale * box_centers[pair, 0], -scale * centers[pair, 0]),
            two_sum(scale * box_centers[pair, 1], -scale * centers[pair, 1]),
            two_sum(scale * box_centers[pair, 2], -scale * centers[pair, 2]),
        )
        middle_high = highs(middle)
        for axis in range(3):
            half_size = scale * box_half_sizes[pair, axis]
            column = (
                box_rotations[pair, 0, axis],
                box_rotations[pair, 1, axis],
                box_rotations[pair, 2, axis],
            )
            lower, upper = _reachable(middle_high, radius, column, half_size)
            store_vector(features, DIRECTIONS + axis, _multiple(half_size, column))
            store_vector(features, STARTS + axis, _multiple(lower, column))
            store_vector(features, ENDS + axis, _multiple(upper, column))
        volume_8th = determinant(
            load_vector(features, DIRECTIONS),
            load_vector(features, DIRECTIONS + 1),
            load_vector(features, DIRECTIONS + 2),
        )
        # For left-handed columns, reversing the first axis makes them right-handed.
        low_u, high_u = (ENDS, STARTS) if volume_8th < 0.0 else (STARTS, ENDS)
        for upper_u in range(2):
            on_u = precise_add(middle, load_vector(features, high_u if upper_u else low_u))
            for upper_v in range(2):
                on_v = precise_add(on_u, load_vector(features, (ENDS if upper_v else STARTS) + 1))
                for upper_w in range(2):
                    corner = precise_add(on_v, load_vector(features, (ENDS if upper_w else STARTS) + 2))
                    store_vector(features, POINTS + upper_u + 2 * upper_v + 4 * upper_w, corner)
        overlap = polyhedron_overlap(features, BOX, radius, 8.0 * abs(volume_8th))
        _store(pair, overlap, 1.0 / scale, volumes, gradients, areas)


@inlined
def _reachable(middle: Vector, radius: float, column: Vector, half_size: float) -> tuple[float, float]:
    """Return the range (m) of a box along the axis `column` to which it is cut off: the sphere reaches no part beyond.

    So a box much larger than the sphere costs no digits.
    """
    place = -dot(middle, column)
    reach = LARGEST_REACH * radius + 1e-5 * (abs(middle[0]) + abs(middle[1]) + abs(middle[2]))
    lower, upper = max(-half_size, place - reach), min(half_size, place + reach)
    if lower < upper:
        return lower, upper
    return -half_size, half_size


@inlined
def _multiple(factor: float, column: Vector) -> PreciseVector:
    return two_product(factor, column[0]), two_product(factor, column[1]), two_product(factor, column[2])


@inlined
def _side(vertices: FloatArray, pair: int, corner: int, scale: float) -> PreciseVector:
    """Return the exact vector from the first corner to the corner `corner`, times `scale`."""
    return (
        two_sum(scale * vertices[pair, corner, 0], -scale * vertices[pair, 0, 0]),
        two_sum(scale * vertices[pair, corner, 1], -scale * vertices[pair, 0, 1]),
        two_sum(scale * vertices[pair, corner, 2], -scale * vertices[pair, 0, 2]),
    )


@inlined
def _scaled_radius(radius: float) -> tuple[float, float]:
    """Return (the radius times a power of two, from 1 to below 2; this power of two)."""
    if radius == 0.0:
        return 0.0, 1.0
    _, exponent = math.frexp(radius)
    scale = math.ldexp(1.0, min(1 - exponent, 1000))
    return scale * radius, scale


@inlined
def _store(
    pair: int, overlap: Overlap, unit: float, volumes: FloatArray, gradients: FloatArray, areas: FloatArray
) -> None:
    """Store the results of `pair` in m³ and m². They were computed with lengths in units of `unit` (m)."""
    volume, gradient, area = overlap
    volumes[pair] = volume * unit * unit * unit
    for axis in range(3):
        gradients[pair, axis] = gradient[axis] * unit * unit
    areas[pair] = area * unit * unit
