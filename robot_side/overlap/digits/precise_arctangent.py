"""Arctangent in double-double, and sums of angles as products of complex numbers.

A table has (cos, sin) of the multiples of π/256 up to π/4. Turned back by the nearest multiple, (x, y) has an angle of
at most π/512, for which eight terms of the arctangent's series suffice.
"""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.overlap.digits.double_double import (
    PI,
    DoubleDouble,
    divided,
    minus,
    multiple,
    negated,
    plus,
    times,
)

STEPS = 256
"""Number of the table's steps in an angle of π"""
_BITS = 200

Turn = tuple[DoubleDouble, DoubleDouble, float]
"""Angle of any size: (real part, imaginary part, number of full turns); the complex number has the rest's angle"""

NO_TURN: Turn = ((1.0, 0.0), (0.0, 0.0), 0.0)


def _split(value: int) -> tuple[float, float]:
    """Return the number `value` / 2^`_BITS`, which is in fixed point, as a double-double."""
    high = value / (1 << _BITS)
    numerator, denominator = high.as_integer_ratio()
    return high, (value - (numerator << _BITS) // denominator) / (1 << _BITS)


def _table() -> FloatArray:
    """Return cosine and sine of the multiples of π/256, as double-doubles (65, 2, 2)."""
    one = 1 << _BITS
    cosine = math.isqrt(one * one // 2)
    for _ in range(6):
        # Half the angle: cos² = (1 + cos) / 2.
        cosine = math.isqrt((one + cosine) * one // 2)
    sine = math.isqrt(one * one - cosine * cosine)
    x, y, rows = one, 0, []
    for _ in range(STEPS // 4 + 1):
        rows.append((_split(x), _split(y)))
        x, y = (x * cosine - y * sine) >> _BITS, (x * sine + y * cosine) >> _BITS
    return np.array(rows)


TABLE = _table()
_THIRD: DoubleDouble = (1.0 / 3.0, 1.850371707708594e-17)
_FIFTH: DoubleDouble = (0.2, -1.1102230246251566e-17)
_SEVENTH: DoubleDouble = (1.0 / 7.0, 7.93016446160826e-18)
_FAR = 2.0**300


@building_block
def arctangent(y: DoubleDouble, x: DoubleDouble) -> DoubleDouble:
    """Return the angle (rad) of the point (x, y) in [-π, π], to 1e-31; 0 for the origin."""
    across, along = (y if y[0] >= 0.0 else negated(y)), (x if x[0] >= 0.0 else negated(x))
    steep = across[0] > along[0]
    if steep:
        across, along = along, across
    if along[0] == 0.0:
        return 0.0, 0.0
    step = int(math.atan(across[0] / along[0]) * (STEPS / math.pi) + 0.5)
    cosine, sine = (TABLE[step, 0, 0], TABLE[step, 0, 1]), (TABLE[step, 1, 0], TABLE[step, 1, 1])
    tangent = divided(minus(times(across, cosine), times(along, sine)), plus(times(along, cosine), times(across, sine)))
    square = times(tangent, tangent)
    q = square[0]
    rest = q * (1.0 / 9.0 - q * (1.0 / 11.0 - q * (1.0 / 13.0 - q * (1.0 / 15.0))))
    series = minus((rest, 0.0), _SEVENTH)
    series = plus(times(square, series), _FIFTH)
    series = minus(times(square, series), _THIRD)
    angle = plus(tangent, times(tangent, times(square, series)))
    angle = plus(angle, multiple(step / STEPS, PI))
    if steep:
        angle = minus((0.5 * PI[0], 0.5 * PI[1]), angle)
    if x[0] < 0.0:
        angle = minus(PI, angle)
    return angle if y[0] >= 0.0 else negated(angle)


@inlined
def turned(turn: Turn, x: DoubleDouble, y: DoubleDouble) -> Turn:
    """Return the sum of the angle `turn` and the angle of the complex number x + i y."""
    real = minus(times(turn[0], x), times(turn[1], y))
    imaginary = plus(times(turn[0], y), times(turn[1], x))
    turns = turn[2]
    # Both angles in [0, π], or both in (-π, 0): only then can the product's angle have wrapped around.
    if turn[1][0] >= 0.0 and y[0] >= 0.0:
        if imaginary[0] < 0.0:
            turns += 1.0
    elif turn[1][0] < 0.0 and y[0] < 0.0 and imaginary[0] >= 0.0:
        turns -= 1.0
    size = abs(real[0]) + abs(imaginary[0])
    if size > _FAR:
        real, imaginary = multiple(1.0 / _FAR, real), multiple(1.0 / _FAR, imaginary)
    elif size < 1.0 / _FAR:
        real, imaginary = multiple(_FAR, real), multiple(_FAR, imaginary)
    return real, imaginary, turns


@inlined
def whole_angle(turn: Turn) -> DoubleDouble:
    """Return the angle in rad, full turns included."""
    return plus(arctangent(turn[1], turn[0]), multiple(2.0 * turn[2], PI))
