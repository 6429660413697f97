import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from common.arrays import FloatArray
from robot_side.arm.resolved_rate import joint_velocities

FREE = np.full(6, np.inf)


def jacobian_with(singular_values: FloatArray, seed: int, joints: int) -> FloatArray:
    random = np.random.default_rng(seed)
    left, _ = np.linalg.qr(random.standard_normal((6, 6)))
    right, _ = np.linalg.qr(random.standard_normal((joints, joints)))
    count = len(singular_values)
    result: FloatArray = (left[:, :count] * singular_values) @ right[:, :count].T
    return result


@settings(derandomize=True, deadline=None, max_examples=100)
@given(
    twist=hnp.arrays(np.float64, 6, elements=st.floats(-5.0, 5.0)),
    limits=hnp.arrays(np.float64, 6, elements=st.floats(0.01, 3.0)),
    seed=st.integers(0, 1000),
)
def test_limits_hold_and_keep_the_direction(twist: FloatArray, limits: FloatArray, seed: int) -> None:
    jacobian = jacobian_with(np.linspace(0.2, 1.0, 6), seed, 6)
    free, limited = joint_velocities(jacobian, twist, FREE), joint_velocities(jacobian, twist, limits)
    assert (np.abs(limited) <= limits * (1.0 + 1e-12)).all()
    # Parallel and of the same sense, and no shorter than it has to be.
    np.testing.assert_allclose(limited * np.linalg.norm(free), free * np.linalg.norm(limited), atol=1e-9)
    assert limited @ free >= 0.0
    if (np.abs(free) > limits).any():
        assert np.max(np.abs(limited) / limits) == pytest.approx(1.0)
    else:
        np.testing.assert_array_equal(limited, free)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_values_that_are_not_finite_are_refused(bad: float) -> None:
    jacobian, twist = np.eye(6), np.zeros(6)
    with pytest.raises(ValueError, match="jacobian"):
        joint_velocities(np.where(np.eye(6) > 0.0, bad, 0.0), twist, FREE)
    with pytest.raises(ValueError, match="twist"):
        joint_velocities(jacobian, np.full(6, bad), FREE)
    for limit in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="velocity_limits_rad_s"):
            joint_velocities(jacobian, twist, np.full(6, limit))
    with pytest.raises(ValueError, match="too large"):
        joint_velocities(1e200 * jacobian_with(np.linspace(0.2, 2.0, 6), 1, 6), np.ones(6), FREE)


@pytest.mark.parametrize("joints", [5, 6, 7])
@pytest.mark.parametrize("smallest", [0.0, 1e-9, 1e-3, 0.02, 0.05, 0.0599, 0.06 - 1e-12, 0.06 + 1e-12, 0.0601, 0.1])
def test_the_solution_is_the_damped_one_on_both_sides_of_the_threshold(smallest: float, joints: int) -> None:
    """Above the threshold it is found without the singular values."""
    twist = np.random.default_rng(7).uniform(-0.2, 0.2, 6)
    for seed in range(20):
        singular_values = np.append(np.linspace(2.0, 0.3, min(joints, 6) - 1), smallest)
        jacobian = jacobian_with(singular_values, seed, joints)
        left, values, right = np.linalg.svd(jacobian, full_matrices=False)
        damping_squared = 0.06**2 * (1.0 - min(values[-1] / 0.06, 1.0) ** 2)
        expected = right.T @ (values / (values**2 + damping_squared) * (left.T @ twist))
        velocity = joint_velocities(jacobian, twist, np.full(joints, np.inf))
        np.testing.assert_allclose(velocity, expected, atol=1e-11)
