"""Position error of points on the gripper from encoder error (eq. 3-7)."""

import math

import numpy as np

from common.arrays import FloatArray, require_finite
from robot_side.compiled.kernel import TRUTH, compiled, input_array, output_array

_UNIT_TOLERANCE = 1e-6


def encoder_sigma(specified_rad: FloatArray, quantisation_step_rad: FloatArray) -> FloatArray:
    """Standard deviation (n,) of an encoder's angle error (eq. 3), radians; metres for a prismatic joint.

    The specified deviation and the rounding to steps, uniform over one step, are independent. ValueError
    for a negative or non-finite argument.
    """
    for name, values in (
        ("specified_rad", specified_rad),
        ("quantisation_step_rad", quantisation_step_rad),
    ):
        require_finite(name, values)
        if (values < 0.0).any():
            raise ValueError(f"{name} = {values.min()} is negative; valid: 0 or more")
    return np.hypot(specified_rad, quantisation_step_rad / math.sqrt(12.0))


def position_covariance(jacobians: FloatArray, encoder_sigma_rad: FloatArray) -> FloatArray:
    """Covariance Σ_ee = J diag(σ_θ²) Jᵀ (m, 3, 3) of the position error of m points (eq. 5), m².

    jacobians (m, 3, n): the points' positional Jacobians at the estimated configuration, m/rad; the result
    is in their frame. encoder_sigma_rad (n,): standard deviation of each joint's error; metres for a
    prismatic joint. ValueError for a wrong shape, a negative deviation or a value that is not finite.
    """
    if jacobians.ndim != 3 or jacobians.shape[1] != 3:
        raise ValueError(f"jacobians has the shape {jacobians.shape}; valid: (m, 3, n)")
    if encoder_sigma_rad.shape != jacobians.shape[2:]:
        raise ValueError(
            f"encoder_sigma_rad has the shape {encoder_sigma_rad.shape}; valid: {jacobians.shape[2:]},"
            " one value for each joint of jacobians"
        )
    covariances = np.empty((len(jacobians), 3, 3))
    if not _covariance_loop(np.ascontiguousarray(jacobians), np.ascontiguousarray(encoder_sigma_rad), covariances):
        require_finite("jacobians", jacobians)
        require_finite("encoder_sigma_rad", encoder_sigma_rad)
        raise ValueError(f"encoder_sigma_rad = {encoder_sigma_rad.min()} is negative; valid: 0 or more")
    return covariances


@compiled(input_array(3), input_array(1), output_array(3), returns=TRUTH)
def _covariance_loop(jacobians: FloatArray, sigma: FloatArray, covariances: FloatArray) -> bool:
    """Σ_ee of each point, and whether every argument is finite and no deviation negative."""
    valid = True
    for joint in range(sigma.size):
        valid &= 0.0 <= sigma[joint] < math.inf
    for point in range(jacobians.shape[0]):
        for row in range(3):
            for joint in range(sigma.size):
                valid &= math.isfinite(jacobians[point, row, joint])
            for column in range(row + 1):
                covariance = 0.0
                for joint in range(sigma.size):
                    variance = sigma[joint] * sigma[joint]
                    covariance += jacobians[point, row, joint] * variance * jacobians[point, column, joint]
                covariances[point, row, column] = covariance
                covariances[point, column, row] = covariance
    return valid


def directional_variance(covariances: FloatArray, directions: FloatArray) -> FloatArray:
    """Variance uᵀ Σ u in m² along unit directions, in the covariances' frame.

    covariances (m, 3, 3); directions (m, 3) give (m,), directions (m, k, 3) give (m, k). ValueError for a
    wrong shape or a direction that is not of unit length.
    """
    count = covariances.shape[0]
    if directions.ndim not in {2, 3} or directions.shape[0] != count or directions.shape[-1] != 3:
        raise ValueError(f"directions has the shape {directions.shape}; valid: ({count}, 3) or ({count}, k, 3)")
    squared = np.einsum("...i,...i->...", directions, directions)
    if not (np.abs(squared - 1.0) <= 2.0 * _UNIT_TOLERANCE).all():
        raise ValueError("directions holds a vector whose length is not 1; valid: unit vectors")
    by_point = directions.reshape(count, -1, 3)
    variance = np.einsum("mki,mki->mk", by_point @ covariances, by_point)
    # Rounding may leave -1e-20 along a direction in which nothing can be wrong.
    result: FloatArray = np.maximum(variance, 0.0).reshape(directions.shape[:-1])
    return result
