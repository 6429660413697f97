"""D_σ of each of the gripper's spheres along a direction (eq. 3-7, 9, 10), and its part that inflates the sphere.

Errors of camera and arm may have any direction, so they inflate the sphere. Prediction errors of the delay lie along
the motion, so they only shorten the contact distances (docs/feel.md).
"""

import math
from typing import Final, NamedTuple

from common.arrays import BoolArray, FloatArray
from robot_side.arm.port import CLUSTER
from robot_side.compiled.kernel import FLOAT64, inlined, tuple_type
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract
from robot_side.enlargement.distance import statistical_distance
from robot_side.field.scratch import Error, ScratchColumns

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
    """Variance of the camera's error: σ_c² in m²"""
    mean_along: float
    """Mean prediction error: μ_δ in m"""
    variance_along: float
    """Variance of the prediction error: σ_δ² in m²"""
    quantile: float
    """Standard normal quantile: Φ⁻¹(P)"""


@inlined
def inflation_and_distance(missed: DirectionalErrors, kinematic: float) -> tuple[float, float]:
    """Return the inflation I and D_σ (both in m) at a point. kinematic: the point's variance (m²) from the encoders."""
    both = kinematic + missed.variance
    inflation = statistical_distance(missed.mean, both, missed.quantile)
    return inflation, statistical_distance(
        missed.mean + missed.mean_along, both + missed.variance_along, missed.quantile
    )


@inlined
def inflate(
    centers: FloatArray,
    radii: FloatArray,
    on_finger: BoolArray,
    tool: Vector,
    jacobian: FloatArray,
    encoder_variance: FloatArray,
    along: Vector,
    missed: DirectionalErrors,
    scratch: ScratchColumns,
) -> bool:
    """Fill the scratch's spheres, inflations, D_σ, errors and clusters. Return False for numbers that are not finite.

    centers (m, 3), radii (m,), on_finger (m,).
    """
    spheres, errors, check = scratch.spheres, scratch.along_m, missed.mean + missed.mean_along
    spread = spread_along(jacobian, encoder_variance, along)
    errors[:] = 0.0
    check += missed.variance + missed.variance_along + missed.quantile
    errors[Error.EXPECTED] = max(0.0, missed.mean + missed.mean_along)
    for i in range(radii.size):
        arm = subtract(load(centers, i), tool)
        kinematic = variance_at(spread, arm)
        inflation, whole = inflation_and_distance(missed, kinematic)
        spheres[i, 0], spheres[i, 1], spheres[i, 2], spheres[i, 3] = *load(centers, i), radii[i]
        scratch.inflation_m[i, 0], scratch.sigma_m[i, 0] = inflation, whole
        scratch.on_finger[i] = on_finger[i]
        errors[Error.LARGEST] = max(errors[Error.LARGEST], whole)
        errors[Error.ALONG] = max(errors[Error.ALONG], whole - inflation)
        # max() may hide NaN; the sum does not.
        check += whole + inflation + kinematic + arm[0] + arm[1] + arm[2] + radii[i]
    for first in range(0, radii.size, CLUSTER):
        middle, radius = around_spheres(spheres, scratch.inflation_m, first, min(first + CLUSTER, radii.size))
        cluster = scratch.clusters[first // CLUSTER]
        cluster[0], cluster[1], cluster[2], cluster[3] = *middle, radius
    return math.isfinite(check)


@inlined
def around_spheres(spheres: FloatArray, inflated: FloatArray, first: int, end: int) -> tuple[Vector, float]:
    """Return centre and radius of a sphere that contains the inflated spheres from `first` to before `end`.

    spheres (m, 4). Each is inflated by the first column of `inflated` (m, 1 or more).
    """
    x, y, z, count = 0.0, 0.0, 0.0, max(end - first, 1)
    for i in range(first, end):
        x, y, z = x + spheres[i, 0], y + spheres[i, 1], z + spheres[i, 2]
    middle, radius = (x / count, y / count, z / count), 0.0
    for i in range(first, end):
        radius = max(radius, norm(subtract(load(spheres, i), middle)) + spheres[i, 3] + inflated[i, 0])
    return middle, radius


ERRORS: Final = tuple_type(*(FLOAT64,) * 5, named=DirectionalErrors)
"""Numba type of `DirectionalErrors`"""
