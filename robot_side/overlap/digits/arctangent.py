"""Angle of the direction (cosine, sine) without a branch, so that LLVM computes several angles at a time.

A call of the C library's atan2 would prevent that. Here the direction is turned until |angle| <= π/8. There the odd
polynomial below differs from the arctangent by less than 6e-18. The result has a relative error below 4e-16.
"""

import math

from robot_side.compiled.kernel import inlined

TANGENT_OF_EIGHTH = math.sqrt(2.0) - 1.0
"""tan(π/8)"""

# (arctan(x)/x - 1)/x² as a polynomial in x² over [0, tan²(π/8)], highest power first: the Chebyshev fit of degree
# 10, which tests/robot_side/overlap/test_digits.py recomputes with mpmath.
COEFFICIENTS = (
    -0.01917688711906226,
    0.03923165829558719,
    -0.0508544973794026,
    0.0585814891280221,
    -0.06664511447381948,
    0.07692183190826087,
    -0.09090904578123903,
    0.11111111015256361,
    -0.14285714284666542,
    0.1999999999999552,
    -0.3333333333333333,
)

# Parts of π/4, π/2 and π that do not fit into a double. Without them, angles close to these lose their last digit.
_QUARTER, _QUARTER_REST = math.pi / 4.0, 3.061616997868383e-17
_HALF, _HALF_REST = math.pi / 2.0, 6.123233995736766e-17
_WHOLE, _WHOLE_REST = math.pi, 1.2246467991473532e-16


@inlined
def arctangent(sine: float, cosine: float) -> float:
    """Return the angle in (-π, π] of the direction (`cosine`, `sine`), of any length; 0 for (0, 0).

    A zero `sine` with a negative `cosine` gives π, whatever the sign of the zero.
    """
    opposite, adjacent = abs(sine), abs(cosine)
    low, high = min(opposite, adjacent), max(opposite, adjacent)
    beyond_eighth = low > TANGENT_OF_EIGHTH * high
    numerator = low - high if beyond_eighth else low
    denominator = low + high if beyond_eighth else high
    tangent = numerator / (denominator if denominator > 0.0 else 1.0)
    square = tangent * tangent
    factor = COEFFICIENTS[0] * square + COEFFICIENTS[1]
    factor = factor * square + COEFFICIENTS[2]
    factor = factor * square + COEFFICIENTS[3]
    factor = factor * square + COEFFICIENTS[4]
    factor = factor * square + COEFFICIENTS[5]
    factor = factor * square + COEFFICIENTS[6]
    factor = factor * square + COEFFICIENTS[7]
    factor = factor * square + COEFFICIENTS[8]
    factor = factor * square + COEFFICIENTS[9]
    factor = factor * square + COEFFICIENTS[10]
    rest = tangent * (square * factor)
    # Each turn adds the double to the large part and the left-out part to the small one.
    large = _QUARTER if beyond_eighth else 0.0
    small = rest + (_QUARTER_REST if beyond_eighth else 0.0)
    turned = opposite > adjacent
    large, tangent = (_HALF - large if turned else large), (-tangent if turned else tangent)
    small = _HALF_REST - small if turned else small
    behind = cosine < 0.0
    large, tangent = (_WHOLE - large if behind else large), (-tangent if behind else tangent)
    small = _WHOLE_REST - small if behind else small
    angle = large + (tangent + small)
    return -angle if sine < 0.0 else angle
