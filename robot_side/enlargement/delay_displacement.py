"""How far the gripper moves before the operator can react (eq. 8)."""

import math

import numpy as np

from common.arrays import FloatArray, require_finite


def delay_displacement(velocities_m_s: FloatArray, loop_age_s: float) -> FloatArray:
    """How far each point moves before the operator can react, ΔT_d = |v| t_d (m,) in metres (eq. 8).

    velocities_m_s (m, 3): of the gripper spheres' centres. loop_age_s: a high quantile of the loop age; a
    caller that does not know it gives the configured worst case, never 0. ValueError for a negative or
    non-finite argument.
    """
    require_age(loop_age_s)
    displacement_m: FloatArray = np.sqrt(np.einsum("mi,mi->m", velocities_m_s, velocities_m_s)) * loop_age_s
    # A velocity that is not finite shows in its displacement.
    if not np.isfinite(displacement_m).all():
        require_finite("velocities_m_s", velocities_m_s)
    return displacement_m


def require_age(loop_age_s: float) -> None:
    """ValueError when `loop_age_s` is negative or not finite."""
    if not 0.0 <= loop_age_s < math.inf:
        raise ValueError(f"loop_age_s = {loop_age_s} is negative or not finite; valid: finite and at least 0")
