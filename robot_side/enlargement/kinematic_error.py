"""Position error of points on the gripper from encoder error (eq. 3-7)."""

import numpy as np

from common.arrays import FloatArray


def position_covariance(jacobians: FloatArray, encoder_sigma_rad: FloatArray) -> FloatArray:
    """Return the covariance Σ_ee = J diag(σ_θ²) Jᵀ (m, 3, 3) of the position error of m points (eq. 5), m².

    jacobians (m, 3, n): the points' positional Jacobians at the estimated configuration, m/rad; the result
    is in their frame. encoder_sigma_rad (n,): standard deviation of each joint's error; metres for a
    prismatic joint. ValueError for another number of joints; NaN passes through.
    """
    if encoder_sigma_rad.shape != jacobians.shape[2:]:
        raise ValueError(f"encoder_sigma_rad has the shape {encoder_sigma_rad.shape}; valid: {jacobians.shape[2:]}")
    covariances: FloatArray = (jacobians * np.square(encoder_sigma_rad)) @ jacobians.swapaxes(1, 2)
    return covariances


def directional_variance(covariances: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the variance uᵀ Σ u in m² along unit directions, in the covariances' frame.

    covariances (m, 3, 3); directions (m, 3) give (m,), directions (m, k, 3) give (m, k).
    """
    by_point = directions.reshape(len(covariances), -1, 3)
    variance = np.einsum("mki,mki->mk", by_point @ covariances, by_point)
    # Rounding may leave -1e-20 along a direction without error.
    result: FloatArray = np.maximum(variance, 0.0).reshape(directions.shape[:-1])
    return result
