"""Resolved-rate control: the joint velocity that moves the tool as asked, by damped least squares.

Nakamura and Hanafusa, 1986; Chiaverini, Siciliano and Egeland, 1994.
"""

import math

import numpy as np

from common.arrays import FloatArray


def joint_velocities(
    jacobian: FloatArray,
    twist: FloatArray,
    velocity_limits_rad_s: FloatArray,
    singular_value_threshold: float = 0.06,
    largest_damping: float = 0.06,
) -> FloatArray:
    """Joint velocities (n,) in rad/s that give the tool `twist`, at most `velocity_limits_rad_s` (n,) each.

    jacobian (6, n) and twist (6,), linear rows first, are in one frame. While the smallest of the Jacobian's
    min(6, n) singular values stays above the threshold there is no damping and the twist is met exactly, or in
    the least-squares sense by an arm with fewer than six joints. Below it λ² = λ_max² (1 - (σ_min/σ_0)²), so that
    no joint runs away at a singularity. A joint over its limit slows all of them alike, which keeps the direction.
    Metres and radians are mixed in the singular values: the defaults suit an arm of about one metre's reach.
    ValueError for a wrong shape, a limit that is not above 0, or a value that is not finite.
    """
    if jacobian.ndim != 2 or jacobian.shape[0] != 6 or jacobian.shape[1] == 0:
        raise ValueError(f"jacobian has the shape {jacobian.shape}; valid: (6, n) with n of 1 or more")
    if twist.shape != (6,):
        raise ValueError(f"twist has the shape {twist.shape}; valid: (6,)")
    if velocity_limits_rad_s.shape != jacobian.shape[1:]:
        raise ValueError(
            f"velocity_limits_rad_s has the shape {velocity_limits_rad_s.shape}; valid: {jacobian.shape[1:]}"
        )
    for name, values in (("jacobian", jacobian), ("twist", twist)):
        if not np.isfinite(values).all():
            raise ValueError(f"{name} holds NaN or infinity; valid: finite numbers")
    # An infinite limit is no limit; NaN fails the comparison.
    if not (velocity_limits_rad_s > 0.0).all():
        raise ValueError("velocity_limits_rad_s holds a value that is not above 0; valid: above 0, rad/s")
    for name, value in (
        ("singular_value_threshold", singular_value_threshold),
        ("largest_damping", largest_damping),
    ):
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} = {value}; valid: finite and above 0")

    left, singular_values, right = np.linalg.svd(jacobian, full_matrices=False)
    nearness = min(singular_values[-1] / singular_value_threshold, 1.0)
    damping_squared = largest_damping**2 * (1.0 - nearness**2)
    gains = singular_values / (singular_values**2 + damping_squared)
    velocity: FloatArray = right.T @ (gains * (left.T @ twist))
    excess = float(np.max(np.abs(velocity) / velocity_limits_rad_s))
    return velocity / max(excess, 1.0)
