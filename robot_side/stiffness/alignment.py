"""How much of an overlap lies in the way of a motion (§4.2).

The gradient of the overlap says where more of it is. It vanishes at the greatest danger of all: for a small
object that the enlarged sphere has swallowed, for a plate through the sphere's centre and for a sphere deep
inside something. There the nearest point of the surface takes its place.
"""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import NUMBER, compiled, inlined, input_array, output_array
from robot_side.compiled.vectors import Vector, add, dot, load, norm, scale
from robot_side.pairs.overlaps import Overlaps


def trust(overlaps: Overlaps, threshold: float) -> FloatArray:
    """Weight (p,) of the gradient as the direction: |∇V| / (threshold πR²), at most 1. Radii above 0."""
    result = np.empty(len(overlaps))
    _trust_loop(overlaps.gradient_m2, overlaps.radius_m, float(threshold), result)
    return result


def alignments(
    overlaps: Overlaps, directions: FloatArray, gradient_trust: FloatArray, inside_margin: float
) -> FloatArray:
    """Share a (k, p), 0 to 1, of each overlap that lies in the way of each of k motions.

    directions (k, p, 3): û of each pair's sphere under each motion, unit or zero; gradient_trust (p,): w from
    `trust`.

    Centre outside: a = w max(0, ĝ·û) + (1 - w) max(0, d·û), with ĝ the unit gradient and d the direction of the
    nearest point. The alignments are blended, not the vectors, which could cancel.

    Centre inside: a = 1 - max(0, -n·û): a motion counts in full unless it reduces the penetration.
    n = v ĝ + (1 - v) deepening with v = |∇V| / πR²: near the surface of something large that is the gradient,
    deep inside it the opposite of the shortest way out, and where there are several (mid-plate) it vanishes.

    Over the last `inside_margin` R before the surface the first turns linearly into the second, so that a is
    continuous in the centre, but at edges and corners that the centre itself meets. A motion that does not move
    the sphere has a = 0.
    """
    result = np.empty(directions.shape[:2])
    _alignment_loop(
        overlaps.gradient_m2,
        overlaps.radius_m,
        overlaps.signed_distance_m,
        overlaps.nearest_direction,
        overlaps.deepening,
        np.ascontiguousarray(directions),
        gradient_trust,
        float(inside_margin),
        result,
    )
    return result


@inlined
def _steepness(gradient: Vector, radius: float) -> float:
    """|∇V| / πR²: at most 1 for one primitive, whose greatest gradient is the disc through the centre."""
    return norm(gradient) / (math.pi * radius * radius)


@compiled(input_array(2), input_array(1), NUMBER, output_array(1))
def _trust_loop(gradients: FloatArray, radii: FloatArray, threshold: float, result: FloatArray) -> None:
    for pair in range(radii.size):
        result[pair] = min(_steepness(load(gradients, pair), radii[pair]) / threshold, 1.0)


@inlined
def _outside(gradient: Vector, weight: float, nearest: Vector, motion: Vector) -> float:
    """The alignment while the centre is outside; `gradient` is a unit vector, or zero."""
    return weight * max(dot(gradient, motion), 0.0) + (1.0 - weight) * max(dot(nearest, motion), 0.0)


@inlined
def _inside(gradient: Vector, weight: float, deepening: Vector, motion: Vector) -> float:
    """The alignment while the centre is inside; `weight` is v."""
    if dot(motion, motion) == 0.0:
        return 0.0
    inward = add(scale(weight, gradient), scale(1.0 - weight, deepening))
    return 1.0 - min(max(-dot(inward, motion), 0.0), 1.0)


@compiled(
    input_array(2),
    input_array(1),
    input_array(1),
    input_array(2),
    input_array(2),
    input_array(3),
    input_array(1),
    NUMBER,
    output_array(2),
)
def _alignment_loop(
    gradients: FloatArray,
    radii: FloatArray,
    distances: FloatArray,
    nearest: FloatArray,
    deepening: FloatArray,
    directions: FloatArray,
    gradient_trust: FloatArray,
    inside_margin: float,
    result: FloatArray,
) -> None:
    for pair in range(radii.size):
        gradient = load(gradients, pair)
        steepness = _steepness(gradient, radii[pair])
        length = norm(gradient)
        unit_gradient = scale(1.0 / length, gradient) if length > 0.0 else gradient
        margin = inside_margin * radii[pair]
        inside_share = min(max(1.0 - distances[pair] / margin, 0.0), 1.0)
        for k in range(directions.shape[0]):
            motion = load(directions[k], pair)
            aligned = 0.0
            if inside_share < 1.0:
                outside = _outside(unit_gradient, gradient_trust[pair], load(nearest, pair), motion)
                aligned += (1.0 - inside_share) * outside
            if inside_share > 0.0:
                # The gradients of overlapping primitives of one object may add up to more than the disc.
                inside = _inside(unit_gradient, min(steepness, 1.0), load(deepening, pair), motion)
                aligned += inside_share * inside
            result[k, pair] = min(aligned, 1.0)
