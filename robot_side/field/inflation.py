"""D_σ of each of the gripper's spheres along a direction (eq. 3-7, 9, 10)."""

import math

import numpy as np

from common.arrays import BoolArray, FloatArray
from robot_side.compiled.kernel import NUMBER, compiled, inlined, input_array, output_array
from robot_side.compiled.vectors import Vector, cross, dot, load, norm, subtract
from robot_side.enlargement.distance import statistical_distance
from robot_side.field.scratch import CLUSTER, ScratchColumns


@inlined
def joint_levers(jacobian: FloatArray, along: Vector) -> FloatArray:
    """For each joint (n, 4): û × ω and û·v, from which a point's share follows; jacobian (6, n)."""
    levers = np.empty((jacobian.shape[1], 4))
    for joint in range(levers.shape[0]):
        turning = cross(along, (jacobian[3, joint], jacobian[4, joint], jacobian[5, joint]))
        levers[joint, 0], levers[joint, 1], levers[joint, 2] = turning
        levers[joint, 3] = dot(along, (jacobian[0, joint], jacobian[1, joint], jacobian[2, joint]))
    return levers


@inlined
def variance_along(arm: Vector, levers: FloatArray, encoder_variance: FloatArray) -> float:
    """ûᵀ J diag(σ_θ²) Jᵀ û in m² of the point at `arm` from the tool (eq. 5): û·(v + ω × r) for each joint."""
    total = 0.0
    for joint in range(encoder_variance.size):
        part = levers[joint, 3] + dot(load(levers, joint), arm)
        total += encoder_variance[joint] * part * part
    return total


@inlined
def inflate(
    centers: FloatArray,
    radii: FloatArray,
    on_finger: BoolArray,
    tool: Vector,
    jacobian: FloatArray,
    encoder_variance: FloatArray,
    along: Vector,
    mean: float,
    variance: float,
    quantile: float,
    scratch: ScratchColumns,
) -> bool:
    """Fill the scratch's spheres, D_σ and clusters; False for what is not finite.

    centers (m, 3), radii (m,), on_finger (m,). D_σ has two columns: at P, and expected (P = 0.5).
    """
    spheres, sigmas, levers, check = scratch.spheres, scratch.sigma_m, joint_levers(jacobian, along), 0.0
    scratch.largest_m[0] = 0.0
    for i in range(radii.size):
        arm = subtract(load(centers, i), tool)
        kinematic = variance_along(arm, levers, encoder_variance)
        found = statistical_distance(mean, kinematic + variance, quantile)
        spheres[i, 0], spheres[i, 1], spheres[i, 2], spheres[i, 3] = *load(centers, i), radii[i]
        sigmas[i, 0], sigmas[i, 1] = found, max(0.0, mean)
        scratch.on_finger[i] = on_finger[i]
        scratch.largest_m[0] = max(scratch.largest_m[0], found)
        # A maximum may hide NaN; a sum does not.
        check += found + mean + kinematic + variance + quantile + arm[0] + arm[1] + arm[2] + radii[i]
    for first in range(0, radii.size, CLUSTER):
        middle, radius = around_spheres(spheres, sigmas, first, min(first + CLUSTER, radii.size))
        cluster = scratch.clusters[first // CLUSTER]
        cluster[0], cluster[1], cluster[2], cluster[3] = *middle, radius
    return math.isfinite(check)


@inlined
def around_spheres(spheres: FloatArray, inflated: FloatArray, first: int, end: int) -> tuple[Vector, float]:
    """A sphere around those from `first` to `end` of spheres (m, 4), inflated by the first column of (m, 1 or more)."""
    x, y, z, count = 0.0, 0.0, 0.0, max(end - first, 1)
    for i in range(first, end):
        x, y, z = x + spheres[i, 0], y + spheres[i, 1], z + spheres[i, 2]
    middle, radius = (x / count, y / count, z / count), 0.0
    for i in range(first, end):
        radius = max(radius, norm(subtract(load(spheres, i), middle)) + spheres[i, 3] + inflated[i, 0])
    return middle, radius


@compiled(
    *(input_array(2), input_array(1), input_array(2), input_array(1), input_array(1), NUMBER, NUMBER, NUMBER),
    *(output_array(1), output_array(1)),
)
def explain_inflation(
    centers: FloatArray,
    tool: FloatArray,
    jacobian: FloatArray,
    encoder_variance: FloatArray,
    direction: FloatArray,
    mean: float,
    variance: float,
    quantile: float,
    kinematic_variance: FloatArray,
    distances: FloatArray,
) -> None:
    """Fill ûᵀΣû (m,) in m² and D_σ (m,) in m of points (m, 3), as `inflate` has them, for people who look."""
    along = load(direction.reshape(1, 3), 0)
    levers, origin = joint_levers(jacobian, along), load(tool.reshape(1, 3), 0)
    for i in range(distances.size):
        kinematic_variance[i] = variance_along(subtract(load(centers, i), origin), levers, encoder_variance)
        distances[i] = statistical_distance(mean, kinematic_variance[i] + variance, quantile)
