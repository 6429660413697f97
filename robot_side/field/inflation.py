"""D_σ of each of the gripper's spheres along a direction (eq. 3-7, 9, 10), and its part that inflates the sphere.

Errors of camera and arm may have any direction, so they inflate the sphere. Prediction errors of the delay lie along
the motion, so they only shorten the contact distances (docs/feel.md).
"""

import math
from typing import Final, NamedTuple

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.arm.port import CLUSTER
from robot_side.compiled.kernel import FLOAT64, building_block, inlined, tuple_type
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract
from robot_side.enlargement.distance import statistical_distance
from robot_side.field.scratch import PART, SCRATCH, Error, ScratchColumns

scratch_at = SCRATCH.at

Spread = tuple[float, Vector, Vector, Vector]
"""Quadratic form in a point's position (x, y, z) from the tool: the constant; the factors of x, y and z; those of x²,
y² and z²; those of yz, zx and xy"""


@inlined
def spread_along(jacobian: FloatArray, encoder_variance: FloatArray, along: Vector) -> Spread:
    """Return the variance ûᵀ J diag(σ_θ²) Jᵀ û (eq. 5) of a point that moves with the tool, for every such point.

    It is a quadratic form in the point's position r from the tool. Turned by 1 rad, a joint moves the point along û by
    û·(v + ω × r) = û·v + (û × ω)·r, where v and ω are the joint's column of `jacobian` (6, n), the tool's.
    """
    at_tool, linear, xx, yy, zz, others = 0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0, (0.0, 0.0, 0.0)
    for joint in range(encoder_variance.size):
        lever = cross(along, (jacobian[3, joint], jacobian[4, joint], jacobian[5, joint]))
        straight = dot(along, (jacobian[0, joint], jacobian[1, joint], jacobian[2, joint]))
        x, y, z = scale(encoder_variance[joint], lever)
        at_tool += encoder_variance[joint] * straight * straight
        linear = add(linear, scale(2.0 * straight, (x, y, z)))
        xx, yy, zz = xx + x * lever[0], yy + y * lever[1], zz + z * lever[2]
        others = add(others, (2.0 * y * lever[2], 2.0 * z * lever[0], 2.0 * x * lever[1]))
    return at_tool, linear, (xx, yy, zz), others


@inlined
def variance_at(spread: Spread, arm: Vector) -> float:
    """Return the variance (m²) of the point at the position `arm` from the tool."""
    at_tool, linear, squares, others = spread
    x, y, z = arm
    products = others[0] * y * z + others[1] * z * x + others[2] * x * y
    variance = at_tool + dot(linear, arm) + dot(squares, (x * x, y * y, z * z)) + products
    # Rounding may bring a small variance below 0. max() would hide NaN.
    return 0.0 if variance < 0.0 else variance


class DirectionalErrors(NamedTuple):
    """Errors along a direction û, without the variance from the encoders (eq. 9-10)."""

    mean: float
    """Mean error of arm and camera along û: û·(μ_ee - μ_c) in m"""
    variance: float
    """Variance of an object's perceived position: σ_c² in m²"""
    mean_along: float
    """Mean prediction error: μ_δ in m"""
    variance_along: float
    """Variance of the prediction error: σ_δ² in m²"""
    quantile: float
    """Standard normal quantile: Φ⁻¹(P)"""
    unseen: float
    """Distance in m by which an object may have moved unseen: it adds to inflation and D_σ"""


@inlined
def own_errors(errors: DirectionalErrors, unseen: float, variance: float) -> DirectionalErrors:
    """Return the errors with the unseen motion and the variance of one object."""
    return DirectionalErrors(errors.mean, variance, errors.mean_along, errors.variance_along, errors.quantile, unseen)


@inlined
def inflation_and_distance(missed: DirectionalErrors, kinematic: float) -> tuple[float, float]:
    """Return the inflation I and D_σ (both in m) at a point. kinematic: the point's variance (m²) from the encoders."""
    both, nearer = kinematic + missed.variance, missed.mean + missed.unseen
    inflation = statistical_distance(nearer, both, missed.quantile)
    return inflation, statistical_distance(nearer + missed.mean_along, both + missed.variance_along, missed.quantile)


@inlined
def around_spheres(spheres: FloatArray, first: int, end: int) -> tuple[Vector, float]:
    """Return centre and radius of a sphere that contains the spheres (m, 4) from `first` to before `end`."""
    x, y, z, count = 0.0, 0.0, 0.0, max(end - first, 1)
    for i in range(first, end):
        x, y, z = x + spheres[i, 0], y + spheres[i, 1], z + spheres[i, 2]
    middle, radius = (x / count, y / count, z / count), 0.0
    for i in range(first, end):
        radius = max(radius, norm(subtract(load(spheres, i), middle)) + spheres[i, 3])
    return middle, radius


@building_block
def _group(scratch_bundle: IntArray, groups: FloatArray, ranges: FloatArray, together: int, count: int) -> None:
    """Bound each group of so many of the scratch's spheres, and their variances from the encoders."""
    scratch = scratch_at(scratch_bundle)
    for first in range(0, count, together):
        end, number, least, most = min(first + together, count), first // together, math.inf, 0.0
        middle, radius = around_spheres(scratch.spheres, first, end)
        for i in range(first, end):
            least, most = min(least, scratch.kinematic_m2[i, 0]), max(most, scratch.kinematic_m2[i, 0])
        group, its = groups[number], ranges[number]
        group[0], group[1], group[2] = middle
        its[0], its[1], its[2] = radius, least, most


@building_block
def place_spheres(
    centers: FloatArray,
    radii: FloatArray,
    on_finger: BoolArray,
    tool: Vector,
    jacobian: FloatArray,
    encoder_variance: FloatArray,
    along: Vector,
    scratch_bundle: IntArray,
) -> bool:
    """Fill the scratch's spheres, and their variances from the encoders, and group them.

    Return False for numbers that are not finite. centers (m, 3), radii (m,), on_finger (m,).
    """
    scratch, count, check = scratch_at(scratch_bundle), radii.size, 0.0
    spheres, spread = scratch.spheres, spread_along(jacobian, encoder_variance, along)
    for i in range(count):
        arm = subtract(load(centers, i), tool)
        kinematic = variance_at(spread, arm)
        spheres[i, 0], spheres[i, 1], spheres[i, 2], spheres[i, 3] = *load(centers, i), radii[i]
        scratch.kinematic_m2[i, 0], scratch.on_finger[i] = kinematic, on_finger[i]
        check += kinematic + arm[0] + arm[1] + arm[2] + radii[i]
    _group(scratch_bundle, scratch.clusters, scratch.cluster_ranges, CLUSTER, count)
    _group(scratch_bundle, scratch.parts, scratch.part_ranges, PART, count)
    _group(scratch_bundle, scratch.whole, scratch.whole_range, max(count, 1), count)
    return math.isfinite(check)


@inlined
def _inflate_groups(missed: DirectionalErrors, groups: FloatArray, ranges: FloatArray, count: int) -> None:
    """Set the groups' radii: inflation rises or falls with the variance throughout."""
    for group in range(count):
        least, _ = inflation_and_distance(missed, ranges[group, 1])
        most, _ = inflation_and_distance(missed, ranges[group, 2])
        groups[group, 3] = ranges[group, 0] + max(least, most)


@inlined
def inflate_sphere(missed: DirectionalErrors, scratch: ScratchColumns, i: int) -> float:
    """Fill the inflation of the scratch's sphere `i`; return its D_σ."""
    scratch.inflation_m[i, 0], whole = inflation_and_distance(missed, scratch.kinematic_m2[i, 0])
    return whole


@building_block
def inflate(missed: DirectionalErrors, scratch_bundle: IntArray, count: int) -> bool:
    """Fill the errors along the direction, and the radii of the groups of the scratch's first `count` spheres.

    Return False for numbers that are not finite.
    """
    scratch = scratch_at(scratch_bundle)
    errors, range_m2 = scratch.along_m, scratch.whole_range[0]
    expected, most = missed.mean + missed.mean_along, 0.0
    errors[Error.EXPECTED] = max(0.0, expected)
    if missed.quantile >= 0.0 and missed.mean + missed.unseen >= 0.0:
        # The root of a sum rises by the less, the larger the other summand.
        inflation, whole = inflation_and_distance(missed, range_m2[1])
        most = max(0.0, whole - inflation)
    else:
        for i in range(count):
            inflation, whole = inflation_and_distance(missed, scratch.kinematic_m2[i, 0])
            most = max(most, whole - inflation)
    errors[Error.ALONG] = most if count > 0 else 0.0
    _inflate_groups(missed, scratch.clusters, scratch.cluster_ranges, (count + CLUSTER - 1) // CLUSTER)
    _inflate_groups(missed, scratch.parts, scratch.part_ranges, (count + PART - 1) // PART)
    _inflate_groups(missed, scratch.whole, scratch.whole_range, 1)
    # max() may hide NaN; the sum does not.
    return math.isfinite(expected + missed.variance + missed.variance_along + missed.quantile + missed.unseen)


@building_block
def inflate_all(missed: DirectionalErrors, scratch_bundle: IntArray, count: int) -> bool:
    """Do as `inflate`; fill also inflation and D_σ of each of the first `count` spheres."""
    scratch, largest, check = scratch_at(scratch_bundle), 0.0, 0.0
    for i in range(count):
        whole = inflate_sphere(missed, scratch, i)
        scratch.sigma_m[i, 0], largest = whole, max(largest, whole)
        check += whole + scratch.inflation_m[i, 0]
    scratch.along_m[Error.LARGEST] = largest
    return inflate(missed, scratch_bundle, count) and math.isfinite(check)


@inlined
def most_along(missed: DirectionalErrors) -> float:
    """Return an upper bound of D_σ - I in m, whatever the variances of camera and encoders."""
    # The root of a sum rises by at most the root of what is added.
    return max(0.0, missed.mean_along + max(missed.quantile, 0.0) * math.sqrt(missed.variance_along))


ERRORS: Final = tuple_type(*(FLOAT64,) * 6, named=DirectionalErrors)
"""Numba type of `DirectionalErrors`"""
