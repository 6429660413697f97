"""Double-double arithmetic against exact fractions and 60-digit functions; the arctangents against mpmath."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import atan, chebyfit, mp, mpf, sqrt

from common.arrays import FloatArray
from robot_side.compiled.kernel import compiled, input_array, output_array
from robot_side.overlap.digits import arctangent as quick
from robot_side.overlap.digits.double_double import (
    DoubleDouble,
    divided,
    minus,
    plus,
    square_root,
    times,
    two_product,
    two_sum,
)
from robot_side.overlap.digits.double_double_vectors import load_vector
from robot_side.overlap.digits.expansion import determinant, exact_power
from robot_side.overlap.digits.precise_arctangent import NO_TURN, arctangent, turned, whole_angle

ROUNDING = Fraction(1, 2**103)
"""Error bound of a result, as `double_double` documents it"""


def _numbers() -> st.SearchStrategy[DoubleDouble]:
    high = st.floats(1e-20, 1e20) | st.floats(-1e20, -1e-20)
    return st.tuples(high, st.floats(-1.0, 1.0)).map(lambda pair: (pair[0], pair[0] * pair[1] * 2.0**-54))


def _exact(number: tuple[float, float] | FloatArray) -> Fraction:
    return Fraction(float(number[0])) + Fraction(float(number[1]))


@compiled(input_array(1), output_array(2))
def _every_operation(numbers: FloatArray, results: FloatArray) -> None:
    a, b = (numbers[0], numbers[1]), (numbers[2], numbers[3])
    results[0, 0], results[0, 1] = plus(a, b)
    results[1, 0], results[1, 1] = minus(a, b)
    results[2, 0], results[2, 1] = times(a, b)
    results[3, 0], results[3, 1] = divided(a, b)
    results[4, 0], results[4, 1] = square_root(a)
    results[5, 0], results[5, 1] = two_sum(a[0], b[0])
    results[6, 0], results[6, 1] = two_product(a[0], b[0])


@compiled(input_array(2), output_array(2))
def _angles(points: FloatArray, results: FloatArray) -> None:
    turn = NO_TURN
    for row in range(points.shape[0]):
        x, y = (points[row, 0], points[row, 1]), (points[row, 2], points[row, 3])
        results[row, 0], results[row, 1] = arctangent(y, x)
        turn = turned(turn, x, y)
        results[row, 2], results[row, 3] = whole_angle(turn)


@compiled(input_array(3), input_array(1), output_array(1))
def _exact_sums(vectors: FloatArray, radius: FloatArray, results: FloatArray) -> None:
    a, b, c = load_vector(vectors, 0), load_vector(vectors, 1), load_vector(vectors, 2)
    results[0] = determinant(a, b, c)
    results[1] = exact_power(a, radius[0])


@settings(derandomize=True, deadline=None, max_examples=300)
@given(_numbers(), _numbers())
def test_operations_are_good_to_31_digits(a: DoubleDouble, b: DoubleDouble) -> None:
    results = np.empty((7, 2))
    _every_operation(np.array([*a, *b]), results)
    x, y = _exact(a), _exact(b)
    assert abs(_exact(results[0]) - (x + y)) <= ROUNDING * (abs(x) + abs(y))
    assert abs(_exact(results[1]) - (x - y)) <= ROUNDING * (abs(x) + abs(y))
    assert abs(_exact(results[2]) / (x * y) - 1) <= ROUNDING
    assert abs(_exact(results[3]) / (x / y) - 1) <= ROUNDING
    # (root (1 + e))² = x (1 + 2 e)
    assert x < 0 or abs(_exact(results[4]) ** 2 / x - 1) <= 2 * ROUNDING
    assert x > 0 or not results[4].any()
    assert _exact(results[5]) == Fraction(a[0]) + Fraction(b[0])
    assert _exact(results[6]) == Fraction(a[0]) * Fraction(b[0])


def _points(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(400, 4))
    points[:, ::2] *= 10.0 ** rng.uniform(-20.0, 20.0, (400, 2))
    points[:100, 2] = points[:100, 0]
    points[100:150, 0], points[150:200, 2] = 0.0, 0.0
    points[:, 1::2] *= 1e-16 * points[:, ::2]
    return points


def test_arctangents_are_good_to_31_digits() -> None:
    points = _points(1)
    results = np.empty((len(points), 4))
    _angles(points, results)
    with mp.workdps(60):
        for point, result in zip(points.tolist(), results.tolist(), strict=True):
            x, y = mpf(point[0]) + mpf(point[1]), mpf(point[2]) + mpf(point[3])
            assert abs(mpf(result[0]) + mpf(result[1]) - mp.atan2(y, x)) <= 1e-31


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angles_add_up_over_whole_turns(sign: float) -> None:
    points = _points(2)
    points[:, 2:] = sign * np.abs(points[:, 2:1:-1])[:, ::-1] * [1.0, 0.0]
    results = np.empty((len(points), 4))
    _angles(points, results)
    with mp.workdps(60):
        total = mpf(0)
        for result in results.tolist():
            total += mpf(result[0]) + mpf(result[1])
            assert abs(mpf(result[2]) + mpf(result[3]) - total) <= 1e-30 * (1 + abs(total))
        assert abs(total) > 100


def test_determinants_and_powers_are_0_only_where_they_are() -> None:
    rng = np.random.default_rng(3)
    for case in range(60):
        rows = rng.normal(size=(3, 3, 2)) * [1.0, 2.0**-60]
        if case % 3:
            # The third vector is a combination of the other two, exactly or with a rounding error.
            rows[..., 1] = 0.0
            rows = np.round(rows, 1) if case % 3 == 1 else np.ldexp(np.round(rows * 256), -8)
            rows[2] = rows[0] * 0.7 - rows[1] if case % 3 == 1 else rows[0] * 3.0 - rows[1]
        a, b, c = ([_exact(number) for number in row] for row in rows)
        minors = [b[(i + 1) % 3] * c[(i + 2) % 3] - b[(i + 2) % 3] * c[(i + 1) % 3] for i in range(3)]
        determinant_ = sum((x * minor for x, minor in zip(a, minors, strict=True)), Fraction(0))
        radius = float(np.linalg.norm(rows[0, :, 0]))
        power = sum((-x * x for x in a), Fraction(radius) ** 2)
        results = np.empty(2)
        _exact_sums(rows, np.array([radius]), results)
        for result, truth in zip(results.tolist(), (determinant_, power), strict=True):
            assert abs(Fraction(result) - truth) <= Fraction(1, 10**14) * abs(truth)
        assert determinant_ == 0 or case % 3 != 2


@compiled(input_array(1), input_array(1), output_array(1))
def _quick_angles(sines: FloatArray, cosines: FloatArray, angles: FloatArray) -> None:
    for lane in range(sines.size):
        angles[lane] = quick.arctangent(sines[lane], cosines[lane])


def angles(sines: FloatArray, cosines: FloatArray) -> FloatArray:
    result = np.empty(len(sines))
    _quick_angles(sines, cosines, result)
    return result


def test_the_coefficients_are_the_chebyshev_fit() -> None:
    with mp.workdps(60):
        end = (sqrt(2) - 1) ** 2

        def factor(square: object) -> object:
            return (atan(sqrt(square)) / sqrt(square) - 1) / square if square else mpf(-1) / 3

        ascending, error = chebyfit(factor, [mpf(0), end], len(quick.COEFFICIENTS), error=True, asc=True)
    assert [float(c) for c in reversed(ascending)] == pytest.approx(quick.COEFFICIENTS, rel=1e-13)
    assert error * end < 6e-18
    assert pytest.approx(math.tan(math.pi / 8), rel=1e-15) == quick.TANGENT_OF_EIGHTH


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
def test_an_angle_is_the_librarys_and_odd(sine: float, cosine: float) -> None:
    # Here the sign of a zero sine has no effect.
    expected = math.atan2(sine + 0.0, cosine) if sine or cosine else 0.0
    found = angles(np.array([sine, -sine]), np.array([cosine, cosine]))
    assert found[0] == pytest.approx(expected, rel=5e-16, abs=1e-300)
    assert sine == 0.0 or found[1] == -found[0]
