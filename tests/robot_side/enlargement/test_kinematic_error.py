import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.enlargement.kinematic_error import (
    directional_variance,
    position_covariance,
)

_LINKS_M = np.array([0.4, 0.3, 0.2])
seeds = st.integers(0, 2**32 - 1)


def _planar_position(angles_rad: FloatArray) -> FloatArray:
    """Tip of a planar arm with the links `_LINKS_M`: (..., 3) for angles (..., 3)."""
    heading = np.cumsum(angles_rad, axis=-1)
    x = (_LINKS_M * np.cos(heading)).sum(axis=-1)
    y = (_LINKS_M * np.sin(heading)).sum(axis=-1)
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def _planar_jacobian(angles_rad: FloatArray) -> FloatArray:
    heading = np.cumsum(angles_rad)
    columns = [
        [
            -(_LINKS_M * np.sin(heading))[joint:].sum(),
            (_LINKS_M * np.cos(heading))[joint:].sum(),
            0.0,
        ]
        for joint in range(3)
    ]
    return np.array(columns).T


def test_covariance_is_what_noisy_encoders_do_to_a_planar_arm() -> None:
    angles = np.array([0.3, -0.7, 1.1])
    sigma = np.array([1e-3, 5e-4, 2e-3])
    covariance = position_covariance(_planar_jacobian(angles)[None], sigma)[0]
    rng = np.random.default_rng(1)
    tips = _planar_position(angles + rng.normal(size=(200_000, 3)) * sigma)
    sampled = np.cov(tips.T)
    # 200 000 samples: a variance is known to 0.32 % (one standard deviation).
    np.testing.assert_allclose(sampled, covariance, atol=0.015 * covariance.max())


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=seeds, points=st.integers(1, 5), joints=st.integers(1, 8))
def test_the_variance_along_a_direction_is_that_of_the_joints_errors(seed: int, points: int, joints: int) -> None:
    """ûᵀ J diag(σ²) Jᵀ û, which is |diag(σ) Jᵀ û|²."""
    rng = np.random.default_rng(seed)
    jacobians, sigma = rng.normal(size=(points, 3, joints)), rng.uniform(0, 1e-2, joints)
    covariance = position_covariance(jacobians, sigma)
    np.testing.assert_allclose(
        covariance, jacobians @ np.diag(sigma**2) @ jacobians.swapaxes(1, 2), rtol=1e-12, atol=1e-18
    )
    directions = rng.normal(size=(points, 7, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    along = directional_variance(covariance, directions)
    moved = np.einsum("pki,pij->pkj", directions, jacobians) * sigma
    np.testing.assert_allclose(along, (moved**2).sum(axis=2), rtol=1e-9, atol=1e-18)
    assert (along >= 0.0).all()
    assert (along <= np.linalg.norm(covariance, 2, axis=(1, 2))[:, None] * (1.0 + 1e-9) + 1e-18).all()
    for k in range(7):
        np.testing.assert_allclose(directional_variance(covariance, directions[:, k]), along[:, k])
