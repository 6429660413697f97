import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.enlargement.distance import Uncertainty, enlargement_distance, plain_enlargements_m
from robot_side.enlargement.kinematic_error import directional_variance, position_covariance

probabilities = st.floats(1e-6, 1.0 - 1e-6)
lengths = st.floats(0.0, 1.0)


@settings(derandomize=True, deadline=None, max_examples=100)
@given(p=probabilities, mean=lengths, sd=st.floats(1e-6, 1.0), delay=lengths)
def test_distance_is_the_quantile_of_the_standard_library(p: float, mean: float, sd: float, delay: float) -> None:
    expected = delay + max(0.0, NormalDist(mean, sd).inv_cdf(p))
    assert enlargement_distance(p, mean, sd**2, delay) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert enlargement_distance(p, [mean], sd**2, delay) == pytest.approx(np.array([expected]), rel=1e-9, abs=1e-9)
    assert Uncertainty(p).quantile == pytest.approx(NormalDist().inv_cdf(p), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 1.1, math.nan, math.inf])
def test_probability_outside_the_open_interval_is_an_error_that_says_so(p: float) -> None:
    with pytest.raises(ValueError, match=r"probability = .* outside \(0, 1\)"):
        enlargement_distance(p, 0.0, 1e-6, 0.0)
    with pytest.raises(ConfigurationError, match=r"probability"):
        Uncertainty(probability=p)


@pytest.mark.parametrize("bad", [-1e-9, math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["mean_m", "variance_m2", "delay_displacement_m"])
def test_negative_and_non_finite_arguments_are_named(name: str, bad: float) -> None:
    arguments: dict[str, Any] = {"mean_m": 0.0, "variance_m2": 1e-6, "delay_displacement_m": 0.0, name: bad}
    with pytest.raises(ValueError, match=name):
        enlargement_distance(0.9, **arguments)
    with pytest.raises(ValueError, match=name):
        enlargement_distance(0.9, **{**arguments, name: np.array([0.0, bad])})


# Known errors


def _covariances(seed: int, count: int = 4) -> FloatArray:
    rng = np.random.default_rng(seed)
    return position_covariance(rng.normal(size=(count, 3, 6)), np.full(6, 1e-3))


_ERRORS: dict[str, Any] = {
    "camera_mean_m": (0.001, 0.002, -0.002),
    "camera_sd_m": 0.002,
    "kinematic_mean_m": (0.001, -0.002, 0.0005),
}


def test_the_mean_along_a_direction_is_how_much_nearer_things_are_than_they_seem() -> None:
    """The mean is û·(μ_ee - μ_c): positive if the gripper is farther ahead, or an object nearer, than it seems."""
    uncertainty = Uncertainty(**_ERRORS)
    direction = np.array([0.6, 0.0, -0.8])
    assert uncertainty.mean_along_m(direction) == pytest.approx(0.6 * (0.001 - 0.001) - 0.8 * (0.0005 + 0.002))
    assert uncertainty.mean_along_m(-direction) == pytest.approx(-uncertainty.mean_along_m(direction))
    assert Uncertainty().mean_along_m(direction) == 0.0


@pytest.mark.parametrize(
    "bad",
    [
        {"camera_sd_m": -1.0},
        {"camera_sd_m": math.nan},
        {"camera_mean_m": (math.nan, 0.0, 0.0)},
        {"kinematic_mean_m": (0.0, math.inf, 0.0)},
    ],
)
def test_bad_settings_are_named(bad: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(bad))):
        Uncertainty(**bad)


# The paper's enlargement


def test_the_plain_enlargement_is_eq_10_for_each_sphere_with_the_trace_and_all_of_the_speed() -> None:
    uncertainty = Uncertainty(probability=0.95, **_ERRORS)
    covariances = _covariances(0)
    velocities = np.random.default_rng(1).normal(size=(4, 3)) * 0.1
    found = plain_enlargements_m(uncertainty, covariances, velocities, 0.15)
    mean = float(np.linalg.norm(_ERRORS["kinematic_mean_m"]) + np.linalg.norm(_ERRORS["camera_mean_m"]))
    for i in range(4):
        variance = float(np.trace(covariances[i])) + 0.002**2
        expected = enlargement_distance(0.95, mean, variance, 0.15 * float(np.linalg.norm(velocities[i])))
        assert found[i] == pytest.approx(expected, rel=1e-12)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), p=st.floats(0.5, 0.999))
def test_along_any_one_direction_less_is_needed_than_plainly(seed: int, p: float) -> None:
    rng = np.random.default_rng(seed)
    covariances = _covariances(seed)
    errors = _ERRORS | {"camera_mean_m": tuple(rng.normal(size=3) * 1e-3)}
    uncertainty = Uncertainty(p, **errors)
    plain = plain_enlargements_m(uncertainty, covariances, np.zeros((4, 3)), 0.1)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    variance = directional_variance(covariances, np.tile(direction, (4, 1))) + uncertainty.camera_sd_m**2
    along = uncertainty.mean_along_m(direction) + uncertainty.quantile * np.sqrt(variance)
    assert (along <= plain + 1e-15).all()


def test_a_velocity_or_covariance_that_is_not_finite_is_no_distance() -> None:
    uncertainty, covariances, still = Uncertainty(), _covariances(3), np.zeros((4, 3))
    for bad in (math.nan, math.inf):
        with pytest.raises(ValueError, match="delay_displacement_m"):
            plain_enlargements_m(uncertainty, covariances, np.full((4, 3), bad), 0.1)
        with pytest.raises(ValueError, match="variance_m2"):
            plain_enlargements_m(uncertainty, np.full((4, 3, 3), bad), still, 0.1)
    for age in (-0.1, math.nan, math.inf):
        with pytest.raises(ValueError, match="delay_displacement_m"):
            plain_enlargements_m(uncertainty, covariances, np.ones((4, 3)), age)


# The arm's own error (eq. 3-7)


_LINKS_M = np.array([0.4, 0.3, 0.2])


def _planar_position(angles_rad: FloatArray) -> FloatArray:
    """Return the positions (..., 3) of the tip of a planar arm with the links `_LINKS_M`, for joint angles (..., 3)."""
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
@given(seed=st.integers(0, 2**32 - 1), points=st.integers(1, 5), joints=st.integers(1, 8))
def test_the_variance_along_a_direction_is_that_of_the_joints_errors(seed: int, points: int, joints: int) -> None:
    """The variance along û is ûᵀ J diag(σ²) Jᵀ û = |diag(σ) Jᵀ û|², for joint errors with standard deviations σ."""
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
