"""The largest eigenvalue of a covariance, against LAPACK's and where eigenvalues coincide."""

import math

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.enlargement.kinematic_error import scalar_variance


def _rotations(count: int) -> FloatArray:
    rotations, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(count, 3, 3)))
    return rotations


def _symmetric(eigenvalues: list[float]) -> FloatArray:
    """500 matrices with these eigenvalues, symmetric to the last digit."""
    rotations = _rotations(500)
    turned = (rotations * eigenvalues) @ rotations.swapaxes(1, 2)
    return 0.5 * (turned + turned.swapaxes(1, 2))


@pytest.mark.parametrize("joints", [1, 2, 3, 7])
@pytest.mark.parametrize("spread", [1.0, 1e-3, 1e-8])
def test_it_is_lapacks_for_covariances_of_any_rank_and_shape(joints: int, spread: float) -> None:
    rng = np.random.default_rng(joints)
    jacobians = _rotations(1000) @ (rng.normal(size=(1000, 3, joints)) * np.array([1.0, spread, spread**2])[:, None])
    covariances = jacobians @ jacobians.swapaxes(1, 2)
    expected = np.linalg.eigvalsh(covariances)[:, -1]
    np.testing.assert_allclose(scalar_variance(covariances), expected, rtol=1e-14)


@pytest.mark.parametrize(
    "eigenvalues", [[2.0, 2.0, 2.0], [2.0, 2.0, 1e-9], [2.0, 2.0, 0.0], [2.0, 1e-16, 1e-16], [2.0, 2.0 - 1e-12, 1.0]]
)
def test_coinciding_eigenvalues_cost_no_digits(eigenvalues: list[float]) -> None:
    np.testing.assert_allclose(scalar_variance(_symmetric(eigenvalues)), 2.0, rtol=1e-14)


@pytest.mark.parametrize("scale", [1e-300, 1e-20, 1.0, 1e100])
def test_no_scale_is_too_small_or_too_large(scale: float) -> None:
    covariances = _symmetric([3.0, 2.0, 1.0]) * scale
    np.testing.assert_allclose(scalar_variance(covariances), 3.0 * scale, rtol=1e-14)


def test_nothing_uncertain_is_zero_and_nothing_known_is_nan() -> None:
    assert scalar_variance(np.zeros((3, 3))) == 0.0
    assert scalar_variance(-1e-20 * np.eye(3)) == 0.0
    for bad in (math.nan, math.inf):
        matrix = np.eye(3)
        matrix[2, 0] = matrix[0, 2] = bad
        assert np.isnan(scalar_variance(matrix))


def test_leading_dimensions_are_kept() -> None:
    covariances = _symmetric([3.0, 2.0, 1.0])[:12].reshape(3, 4, 3, 3)
    assert scalar_variance(covariances).shape == (3, 4)
    np.testing.assert_array_equal(scalar_variance(covariances[::2, 1]), scalar_variance(covariances)[::2, 1])
