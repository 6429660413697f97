"""How much of an overlap lies in the way of a motion (§4.2).

The gradient of the overlap says where more of it is. It vanishes at the greatest danger of all: for a small
object that the enlarged sphere has swallowed, for a plate through the sphere's centre and for a sphere deep
inside something. There the nearest point of the surface takes its place.
"""

import numpy as np

from common.arrays import FloatArray
from robot_side.overlapping import Overlaps


def trust(overlaps: Overlaps, threshold: float) -> FloatArray:
    """Weight (p,) of the gradient as the direction: |∇V| / (threshold πR²), at most 1. Radii above 0."""
    limit: FloatArray = np.minimum(1.0, _relative_steepness(overlaps) / threshold)
    return limit


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
    steepness = _relative_steepness(overlaps)
    length = steepness * np.pi * overlaps.radius_m**2
    unit_gradient = overlaps.gradient_m2 / np.where(length > 0.0, length, 1.0)[:, None]
    aligned = gradient_trust * np.maximum(0.0, _along(directions, unit_gradient))
    if (gradient_trust < 1.0).any():
        aligned += (1.0 - gradient_trust) * np.maximum(0.0, _along(directions, overlaps.nearest_direction))
    margin_m = inside_margin * overlaps.radius_m
    rows = np.flatnonzero(overlaps.signed_distance_m < margin_m)
    if len(rows) > 0:
        inside_share = np.minimum(1.0, 1.0 - overlaps.signed_distance_m[rows] / margin_m[rows])
        # The gradients of overlapping primitives of one object may add up to more than the disc.
        of_gradient = np.minimum(1.0, steepness[rows])[:, None]
        inward = of_gradient * unit_gradient[rows] + (1.0 - of_gradient) * overlaps.deepening[rows]
        moving = directions[:, rows].any(axis=2)
        reduction = np.clip(-_along(directions[:, rows], inward), 0.0, 1.0)
        aligned[:, rows] += inside_share * (np.where(moving, 1.0 - reduction, 0.0) - aligned[:, rows])
    result: FloatArray = np.minimum(1.0, aligned)
    return result


def _relative_steepness(overlaps: Overlaps) -> FloatArray:
    """|∇V| / πR² (p,): at most 1 for one primitive, whose greatest gradient is the disc through the centre."""
    gradient = overlaps.gradient_m2
    steepness: FloatArray = np.sqrt(np.einsum("pi,pi->p", gradient, gradient)) / (np.pi * overlaps.radius_m**2)
    return steepness


def _along(directions: FloatArray, vectors: FloatArray) -> FloatArray:
    """Dot products (k, p) of directions (k, p, 3) with vectors (p, 3)."""
    result: FloatArray = np.einsum("kpi,pi->kp", directions, vectors)
    return result
