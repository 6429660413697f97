import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.enlargement.delay_displacement import delay_displacement
from robot_side.enlargement.distance import (
    Enlargement,
    EnlargementSettings,
    combined_mean,
    combined_variance,
    enlargement_distance,
)
from robot_side.enlargement.kinematic_error import position_covariance

probabilities = st.floats(1e-6, 1.0 - 1e-6)
lengths = st.floats(0.0, 1.0)


@settings(derandomize=True, deadline=None, max_examples=100)
@given(p=probabilities, mean=lengths, sd=st.floats(1e-6, 1.0), delay=lengths)
def test_distance_is_the_quantile_of_the_standard_library(p: float, mean: float, sd: float, delay: float) -> None:
    expected = delay + max(0.0, NormalDist(mean, sd).inv_cdf(p))
    assert enlargement_distance(p, mean, sd**2, delay) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(p=probabilities, higher=probabilities, mean=lengths, variance=lengths, delay=lengths)
def test_distance_grows_with_probability_and_never_falls_below_the_delay_part(
    p: float, higher: float, mean: float, variance: float, delay: float
) -> None:
    small = enlargement_distance(min(p, higher), mean, variance, delay)
    large = enlargement_distance(max(p, higher), mean, variance, delay)
    assert delay <= small <= large


def test_known_values_and_types() -> None:
    assert enlargement_distance(0.5, 0.003, 1e-4, 0.001) == pytest.approx(0.004, rel=1e-12)
    # Φ⁻¹(0.99) = 2.3263478740408408 (tables of the standard normal distribution).
    assert enlargement_distance(0.99, 0.0, 1e-6, 0.0) == pytest.approx(2.3263478740408408e-3, rel=1e-12)
    # A quantile below 0 does not shrink the gripper.
    assert enlargement_distance(0.01, 0.0, 1e-6, 0.002) == 0.002
    assert enlargement_distance(0.01, 0.003, 0.0, 0.002) == 0.005
    assert isinstance(enlargement_distance(0.9, 0.0, 0.0, 0.0), float)
    table = enlargement_distance(0.9, np.zeros((2, 1)), np.array([0.0, 1e-6, 4e-6]), 0.1)
    assert isinstance(table, np.ndarray)
    assert table.shape == (2, 3)
    assert table[1, 2] == enlargement_distance(0.9, 0.0, 4e-6, 0.1)


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 1.1, math.nan, math.inf])
def test_probability_outside_the_open_interval_is_an_error_that_says_so(p: float) -> None:
    with pytest.raises(ValueError, match=r"probability = .* outside \(0, 1\)"):
        enlargement_distance(p, 0.0, 1e-6, 0.0)
    with pytest.raises(ConfigurationError, match=r"probability"):
        EnlargementSettings(probability=p)


@pytest.mark.parametrize("bad", [-1e-9, math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["mean_m", "variance_m2", "delay_displacement_m"])
def test_negative_and_non_finite_arguments_are_named(name: str, bad: float) -> None:
    arguments: dict[str, Any] = {"mean_m": 0.0, "variance_m2": 1e-6, "delay_displacement_m": 0.0, name: bad}
    with pytest.raises(ValueError, match=name):
        enlargement_distance(0.9, **arguments)
    with pytest.raises(ValueError, match=name):
        enlargement_distance(0.9, **{**arguments, name: np.array([0.0, bad])})


def test_delay_displacement_is_speed_times_age() -> None:
    velocities = np.array([[0.3, 0.0, 0.4], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(delay_displacement(velocities, 0.2), [0.1, 0.0])
    for age in (-0.1, math.nan, math.inf):
        with pytest.raises(ValueError, match="loop_age_s"):
            delay_displacement(velocities, age)
    with pytest.raises(ValueError, match="velocities_m_s"):
        delay_displacement(np.array([[math.nan, 0.0, 0.0]]), 0.1)


def test_means_and_variances_combine_as_eq_10_says() -> None:
    assert combined_mean(-0.002, -0.001) == pytest.approx(0.002 + math.sqrt(3.0) * 0.001)
    np.testing.assert_allclose(combined_variance(np.array([1e-6, 4e-6]), 2e-3), [5e-6, 8e-6])


def _covariances(seed: int, count: int = 4) -> FloatArray:
    rng = np.random.default_rng(seed)
    return position_covariance(rng.normal(size=(count, 3, 6)), np.full(6, 1e-3))


_ERRORS: dict[str, Any] = {
    "camera_mean_m": 0.001,
    "camera_sd_m": 0.002,
    "kinematic_mean_m": (0.001, -0.002, 0.0005),
}


def test_isotropic_distances_are_eq_10_for_each_sphere() -> None:
    chosen = EnlargementSettings(probability=0.95, **_ERRORS)
    covariances = _covariances(0)
    velocities = np.random.default_rng(1).normal(size=(4, 3)) * 0.1
    distances = Enlargement(chosen).distances(covariances, velocities, 0.15)
    mean = float(np.linalg.norm(chosen.kinematic_mean_m)) + math.sqrt(3.0) * 0.001
    for i in range(4):
        variance = float(np.linalg.norm(covariances[i], 2)) + 0.002**2
        expected = enlargement_distance(0.95, mean, variance, 0.15 * float(np.linalg.norm(velocities[i])))
        assert distances[i] == pytest.approx(expected, rel=1e-12)


def test_once_keeps_the_largest_statistical_part_of_the_sampled_configurations() -> None:
    sampled = np.stack([_covariances(seed) for seed in range(10)])
    still = np.zeros((4, 3))
    present = Enlargement(EnlargementSettings(**_ERRORS))
    largest = max(present.distances(covariances, still, 0.1).max() for covariances in sampled)
    once = Enlargement(EnlargementSettings(mode="once", **_ERRORS), sampled)
    np.testing.assert_allclose(once.distances(sampled[3], still, 0.1), np.full(4, largest))
    moving = np.full((4, 3), 0.1)
    np.testing.assert_allclose(once.distances(sampled[3], moving, 0.1), largest + delay_displacement(moving, 0.1))
    with pytest.raises(ValueError, match="sampled_covariances"):
        Enlargement(EnlargementSettings(mode="once"))


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), p=st.floats(0.5, 0.999), once=st.booleans())
def test_towards_an_object_never_needs_more_than_isotropic(seed: int, p: float, once: bool) -> None:
    rng = np.random.default_rng(seed)
    covariances = _covariances(seed)
    chosen = EnlargementSettings(
        probability=p,
        camera_mean_m=float(rng.normal() * 1e-3),
        camera_sd_m=1e-3,
        kinematic_mean_m=(0.001, -0.002, 0.0005),
        mode="once" if once else "per_configuration",
        direction="towards_object",
    )
    enlargement = Enlargement(chosen, covariances)
    velocities = rng.normal(size=(4, 3)) * 0.2
    directions = rng.normal(size=(4, 5, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    towards = enlargement.distances_towards(covariances, velocities, 0.1, directions)
    isotropic = enlargement.distances(covariances, velocities, 0.1)
    assert towards.shape == (4, 5)
    assert (towards >= 0.0).all()
    assert (towards <= isotropic[:, None] * (1.0 + 1e-12)).all()
    pairs = enlargement.distances_towards(covariances, velocities, 0.1, directions[:, 2])
    np.testing.assert_allclose(pairs, towards[:, 2], rtol=1e-12)


def test_distance_towards_an_object_covers_the_drawn_errors_with_probability_p() -> None:
    """True position and perceived object drawn many times: the gap closes by more than D in 1 - P of them."""
    rng = np.random.default_rng(5)
    covariances = _covariances(7, count=1)
    chosen = EnlargementSettings(probability=0.9, direction="towards_object", **_ERRORS)
    direction = np.array([[0.6, 0.0, 0.8]])
    distance = Enlargement(chosen).distances_towards(covariances, np.zeros((1, 3)), 0.1, direction)[0]
    draws = 200_000
    gripper_error = rng.multivariate_normal(chosen.kinematic_mean_m, covariances[0], draws)
    object_error = rng.normal(0.001, 0.002, (draws, 3))
    closing = (gripper_error + object_error) @ direction[0]
    assert (closing <= distance).mean() == pytest.approx(0.9, abs=0.003)


def test_retreat_needs_no_delay_displacement_towards_the_object() -> None:
    enlargement = Enlargement(EnlargementSettings(direction="towards_object"))
    none = np.zeros((1, 3, 3))
    towards = np.array([[1.0, 0.0, 0.0]])
    assert enlargement.distances_towards(none, np.array([[0.3, 0.4, 0.0]]), 0.1, towards)[0] == 0.03
    assert enlargement.distances_towards(none, np.array([[-0.3, 0.4, 0.0]]), 0.1, towards)[0] == 0.0


@pytest.mark.parametrize(
    "bad",
    [
        {"camera_sd_m": -1.0},
        {"camera_mean_m": math.nan},
        {"kinematic_mean_m": (0.0, math.inf, 0.0)},
        {"measure": "max"},
        {"mode": "twice"},
        {"direction": "up"},
    ],
)
def test_bad_settings_are_named(bad: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(bad))):
        EnlargementSettings(**bad)


def test_a_velocity_or_covariance_that_is_not_finite_is_no_distance() -> None:
    enlargement = Enlargement(EnlargementSettings())
    covariances, still = _covariances(3), np.zeros((4, 3))
    for bad in (math.nan, math.inf):
        with pytest.raises(ValueError, match="velocities_m_s"):
            enlargement.distances(covariances, np.full((4, 3), bad), 0.1)
        with pytest.raises(ValueError, match="covariances"):
            enlargement.distances(np.full((4, 3, 3), bad), still, 0.1)
    for age in (-0.1, math.nan, math.inf):
        with pytest.raises(ValueError, match="loop_age_s"):
            enlargement.distances(covariances, still, age)
