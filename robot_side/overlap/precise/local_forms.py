"""Overlaps of a sphere with a single corner or edge of a solid, as sums of positive terms: so nothing cancels.

A tiny overlap with a corner is nearly the tetrahedron of the corner and the points where its three edges leave the
ball. The overlap with an edge is nearly a stack of triangles along it. Only the side on the sphere is not flat but
bulges slightly: a ray from the corner meets the sphere at s times the distance of the flat side. The factor s is smooth
and little above 1, so Gauss quadrature gives the mean of its powers. The relative accuracy is that of the inputs,
however small the overlap is. The quadrature's relative error is below 1e-12 up to the sharpness SHARP_CORNER or
SHARP_EDGE.
"""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, norm, scale
from robot_side.overlap.digits.double_double_vectors import (
    PreciseVector,
    highs,
    precise_cross,
    precise_dot,
)
from robot_side.overlap.solids.solid import Overlap, nothing

SHARP_CORNER = 4e-4
"""Largest sharpness for which `corner_overlap` is accurate. The sharpness is the largest, over the corner's edges, of
(length of the edge in the ball) / (distance of the sphere's centre from the corner, measured along the edge)."""
SHARP_EDGE = 0.05
"""Largest sharpness for which `edge_overlap` is accurate. The sharpness is the larger, over the edge's two faces, of
(half the length of the edge in the ball) / (distance of the sphere's centre from the edge, measured along the face)."""


def _triangle_rule() -> tuple[FloatArray, FloatArray]:
    """Return Radon's rule for integrals over a triangle, 7 points, degree 5: (barycentric coordinates, weights)."""
    root = math.sqrt(15.0)
    points, weights = [[1.0 / 3.0] * 3], [9.0 / 40.0]
    for sign in (-1.0, 1.0):
        aside, weight = (6.0 + sign * root) / 21.0, (155.0 + sign * root) / 1200.0
        for corner in range(3):
            points.append([1.0 - 2.0 * aside if axis == corner else aside for axis in range(3)])
            weights.append(weight)
    return np.array(points), np.array(weights)


TRIANGLE_POINTS, TRIANGLE_WEIGHTS = _triangle_rule()
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
ALONG_NODES, ALONG_WEIGHTS = _NODES[4:].copy(), 2.0 * _WEIGHTS[4:]
"""Gauss-Legendre rule of 8 points for even functions on [-1, 1]: positive nodes only, with doubled weights"""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
ACROSS_NODES, ACROSS_WEIGHTS = 0.5 + 0.5 * _NODES, 0.5 * _WEIGHTS
"""Gauss-Legendre rule of 4 points on [0, 1]"""


@inlined
def reach(outward: float, power: float) -> float:
    """Return the length (m) of a ray inside the ball, from a point p in the ball.

    `power` is R² - |p|² > 0, `outward` is p · (the ray's unit vector).
    """
    root = math.sqrt(outward * outward + power)
    return power / (outward + root) if outward > 0.0 else root - outward


@building_block
def corner_overlap(
    corner: PreciseVector,
    power: float,
    edges: tuple[PreciseVector, PreciseVector, PreciseVector],
    radius: float,
) -> tuple[Overlap, float]:
    """Return the overlap of the ball about the origin with the cone that three edges span, and the sharpness.

    `corner` is the cone's tip; it lies in the ball, so its `power` R² - |corner|² (m²) is positive. `edges` are unit
    vectors from the tip.
    """
    first, second, third = edges
    outward = precise_dot(corner, first)[0], precise_dot(corner, second)[0], precise_dot(corner, third)[0]
    lengths = reach(outward[0], power), reach(outward[1], power), reach(outward[2], power)
    sharpness = 0.0
    for axis in range(3):
        sharpness = max(sharpness, lengths[axis] / outward[axis] if outward[axis] > 0.0 else math.inf)
    determinant = abs(precise_dot(first, precise_cross(second, third))[0])
    if determinant == 0.0:
        return nothing(), math.inf
    tetrahedron = lengths[0] * lengths[1] * lengths[2] * determinant / 6.0
    arms = scale(lengths[0], highs(first)), scale(lengths[1], highs(second)), scale(lengths[2], highs(third))
    volume, area, push = 0.0, 0.0, (0.0, 0.0, 0.0)
    for point in range(TRIANGLE_WEIGHTS.size):
        shares = TRIANGLE_POINTS[point]
        ray = add(add(scale(shares[0], arms[0]), scale(shares[1], arms[1])), scale(shares[2], arms[2]))
        along = (
            shares[0] * lengths[0] * outward[0]
            + shares[1] * lengths[1] * outward[1]
            + shares[2] * lengths[2] * outward[2]
        )
        factor, patch, away = _stretch(highs(corner), ray, along, power)
        weight = TRIANGLE_WEIGHTS[point] * tetrahedron
        volume += weight * factor * factor * factor
        patch *= 3.0 * weight * factor * factor
        area += patch * radius
        push = add(push, scale(patch, away))
    return _within_cap((volume, push, area), power, radius), sharpness


@building_block
def edge_overlap(
    foot: PreciseVector,
    power: float,
    sides: tuple[PreciseVector, PreciseVector],
    radius: float,
) -> tuple[Overlap, float]:
    """Return the overlap of the ball about the origin with the wedge of two faces, and the sharpness.

    `foot` is the point of the edge nearest to the centre; it lies in the ball, so its `power` R² - |foot|² (m²) is
    positive. `sides` are unit vectors, one in each face, at right angles to the edge and away from it.
    """
    first, second = sides
    outward = precise_dot(foot, first)[0], precise_dot(foot, second)[0]
    half_chord = math.sqrt(power)
    least = min(outward[0], outward[1])
    sharpness = half_chord / least if least > 0.0 else math.inf
    sine = norm(highs(precise_cross(first, second)))
    if sine == 0.0:
        return nothing(), math.inf
    volume, area, push = 0.0, 0.0, (0.0, 0.0, 0.0)
    for slice_number in range(ALONG_WEIGHTS.size):
        node = ALONG_NODES[slice_number]
        slice_power = power * (1.0 - node) * (1.0 + node)
        lengths = reach(outward[0], slice_power), reach(outward[1], slice_power)
        triangle = 0.5 * lengths[0] * lengths[1] * sine * half_chord * ALONG_WEIGHTS[slice_number]
        arms = scale(lengths[0], highs(first)), scale(lengths[1], highs(second))
        for point in range(ACROSS_WEIGHTS.size):
            share = ACROSS_NODES[point]
            ray = add(scale(1.0 - share, arms[0]), scale(share, arms[1]))
            along = (1.0 - share) * lengths[0] * outward[0] + share * lengths[1] * outward[1]
            factor, patch, away = _stretch(highs(foot), ray, along, slice_power)
            weight = ACROSS_WEIGHTS[point] * triangle
            volume += weight * factor * factor
            patch *= 2.0 * weight * factor
            area += patch * radius
            push = add(push, scale(patch, away))
    return _within_cap((volume, push, area), power, radius), sharpness


@inlined
def _within_cap(overlap: Overlap, power: float, radius: float) -> Overlap:
    """Cut the overlap to a bound of the cap that a plane cuts off the ball.

    The plane goes through the corner or foot point p, at right angles to p. `power` is R² - |p|² (m²). A cone or wedge
    that is too blunt for its form may reach deeper into the ball elsewhere than at p: then its overlap is too large.
    """
    volume, push, area = overlap
    most = 2.0 * math.pi * power
    share = most / area if area > most else 1.0
    return min(volume, math.pi * power * power / radius), scale(share, push), share * area


@inlined
def _stretch(origin: Vector, ray: Vector, along: float, power: float) -> tuple[float, float, Vector]:
    """Return (s, 1 / √discriminant, the point origin + s · `ray`), at which the ray from `origin` meets the sphere.

    `along` is origin · ray, `power` is R² - |origin|². The second number gives surface elements: times the straight
    part's volume element and 3 s² (cone) or 2 s (wedge), it is the element of the sphere's surface divided by R.
    """
    length_2 = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]
    root = math.sqrt(along * along + power * length_2)
    factor = power / (along + root) if along > 0.0 else (root - along) / length_2
    return factor, 1.0 / root, add(origin, scale(factor, ray))
