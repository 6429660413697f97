"""How encoder error becomes position error of points on the gripper (eq. 3-7)."""

import math
from typing import Literal

import numpy as np

from common.arrays import FloatArray

VarianceMeasure = Literal["isotropic", "trace"]
"""How a covariance becomes one variance: its largest eigenvalue, or the paper's sum over the axes."""

_UNIT_TOLERANCE = 1e-6


def require_finite(name: str, values: FloatArray) -> None:
    """Raise a ValueError that names the argument when an element of `values` is NaN or infinite."""
    if not np.isfinite(values).all():
        raise ValueError(f"{name} holds NaN or infinity; valid: finite numbers")


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
    require_finite("jacobians", jacobians)
    require_finite("encoder_sigma_rad", encoder_sigma_rad)
    if (encoder_sigma_rad < 0.0).any():
        raise ValueError(f"encoder_sigma_rad = {encoder_sigma_rad.min()} is negative; valid: 0 or more")
    scaled = jacobians * encoder_sigma_rad
    return scaled @ scaled.swapaxes(1, 2)


def scalar_variance(covariances: FloatArray, measure: VarianceMeasure = "isotropic") -> FloatArray:
    """One variance σ_p² (...,) in m² for each covariance (..., 3, 3) (eq. 5 and 7).

    `isotropic`: the largest eigenvalue, the variance along the worst direction. `trace`: the paper's sum of
    the variances along the axes, up to three times as much. ValueError for another measure.
    """
    if measure == "trace":
        total: FloatArray = np.trace(covariances, axis1=-2, axis2=-1)
        return total
    if measure == "isotropic":
        # A singular covariance (n < 3 joints) may have a largest eigenvalue of -1e-20 where it has 0.
        largest: FloatArray = np.maximum(np.linalg.eigvalsh(covariances)[..., -1], 0.0)
        return largest
    raise ValueError(f"measure = {measure!r} is unknown; valid: 'isotropic', 'trace'")


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
