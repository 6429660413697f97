"""The branch-free arctangent against mpmath and the C library."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import atan, chebyfit, mp, mpf, sqrt

from common.arrays import FloatArray
from robot_side.compiled.kernel import compiled, input_array, output_array
from robot_side.overlap.digits.arctangent import COEFFICIENTS, TANGENT_OF_EIGHTH, arctangent


@compiled(input_array(1), input_array(1), output_array(1))
def _angles(sines: FloatArray, cosines: FloatArray, angles: FloatArray) -> None:
    for lane in range(sines.size):
        angles[lane] = arctangent(sines[lane], cosines[lane])


def angles(sines: FloatArray, cosines: FloatArray) -> FloatArray:
    result = np.empty(len(sines))
    _angles(sines, cosines, result)
    return result


def test_the_coefficients_are_the_chebyshev_fit() -> None:
    with mp.workdps(60):
        end = (sqrt(2) - 1) ** 2

        def factor(square: object) -> object:
            return (atan(sqrt(square)) / sqrt(square) - 1) / square if square else mpf(-1) / 3

        ascending, error = chebyfit(factor, [mpf(0), end], len(COEFFICIENTS), error=True, asc=True)
    assert [float(c) for c in reversed(ascending)] == pytest.approx(COEFFICIENTS, rel=1e-13)
    assert error * end < 6e-18
    assert pytest.approx(math.tan(math.pi / 8), rel=1e-15) == TANGENT_OF_EIGHTH


def test_every_direction_is_right_to_the_last_digits() -> None:
    rng = np.random.default_rng(0)
    turns = np.concatenate(
        [
            rng.uniform(-np.pi, np.pi, 20_000),
            (np.arange(-8, 9)[:, None] * np.pi / 8 + rng.normal(size=(17, 500)) * 1e-9).ravel(),
        ]
    )
    lengths = np.exp(rng.uniform(-30, 30, len(turns)))
    sines, cosines = lengths * np.sin(turns), lengths * np.cos(turns)
    found = angles(sines, cosines)
    with mp.workdps(40):
        true = [mp.atan2(mpf(s), mpf(c)) for s, c in zip(sines, cosines, strict=True)]
        errors = [abs(mpf(f) - t) / abs(t) for f, t in zip(found, true, strict=True)]
    assert max(errors) < 4e-16


@settings(derandomize=True, deadline=None)
@given(st.floats(-1e150, 1e150), st.floats(-1e150, 1e150))
def test_it_is_the_librarys(sine: float, cosine: float) -> None:
    # A zero sine has no sign here.
    expected = math.atan2(sine + 0.0, cosine) if sine or cosine else 0.0
    assert angles(np.array([sine]), np.array([cosine]))[0] == pytest.approx(expected, rel=5e-16, abs=1e-300)


def test_angles_of_opposite_directions_are_opposite() -> None:
    rng = np.random.default_rng(1)
    sines, cosines = rng.normal(size=(2, 1000))
    np.testing.assert_array_equal(angles(-sines, cosines), -angles(sines, cosines))
