"""Double-double arithmetic: each number is the unevaluated sum of two floats, with some 31 digits.

It is built from Knuth's two-sum, Dekker's fast two-sum and the two-product with a fused multiply-add, after Hida, Li
and Bailey, "Library for double-double and quad-double arithmetic" (2007). Unless stated otherwise, the error of a
result is at most 2⁻¹⁰³ times the sum of the terms' magnitudes. So the relative error is small if nothing cancels.
Overflow and products below 1e-290 are not treated.
"""

import math

from robot_side.compiled.kernel import fused_multiply_add, inlined

DoubleDouble = tuple[float, float]
"""(high, low): stands for the number high + low, where high is this number rounded to a float"""

PI: DoubleDouble = (3.141592653589793, 1.2246467991473532e-16)
ZERO: DoubleDouble = (0.0, 0.0)


@inlined
def fast_two_sum(a: float, b: float) -> DoubleDouble:
    """Return the exact sum a + b of two floats with |a| >= |b| or a = 0."""
    high = a + b
    return high, b - (high - a)


@inlined
def two_sum(a: float, b: float) -> DoubleDouble:
    """Return the exact sum a + b of two floats."""
    high = a + b
    part = high - a
    return high, (a - (high - part)) + (b - part)


@inlined
def two_product(a: float, b: float) -> DoubleDouble:
    """Return the exact product a · b of two floats."""
    high = a * b
    return high, fused_multiply_add(a, b, -high)


@inlined
def rounded(a: DoubleDouble) -> float:
    """Return the nearest float."""
    return a[0] + a[1]


@inlined
def negated(a: DoubleDouble) -> DoubleDouble:
    """Return -a."""
    return -a[0], -a[1]


@inlined
def plus(a: DoubleDouble, b: DoubleDouble) -> DoubleDouble:
    """Return the sum a + b."""
    high, low = two_sum(a[0], b[0])
    return fast_two_sum(high, low + (a[1] + b[1]))


@inlined
def minus(a: DoubleDouble, b: DoubleDouble) -> DoubleDouble:
    """Return the difference a - b."""
    return plus(a, negated(b))


@inlined
def times(a: DoubleDouble, b: DoubleDouble) -> DoubleDouble:
    """Return the product a · b."""
    high, low = two_product(a[0], b[0])
    return fast_two_sum(high, fused_multiply_add(a[0], b[1], fused_multiply_add(a[1], b[0], low)))


@inlined
def multiple(factor: float, a: DoubleDouble) -> DoubleDouble:
    """Return the product of a float and a double-double."""
    high, low = two_product(factor, a[0])
    return fast_two_sum(high, fused_multiply_add(factor, a[1], low))


@inlined
def divided(a: DoubleDouble, b: DoubleDouble) -> DoubleDouble:
    """Return the quotient a / b; b is not 0."""
    quotient = a[0] / b[0]
    rest = fused_multiply_add(-quotient, b[0], a[0]) + fused_multiply_add(-quotient, b[1], a[1])
    return fast_two_sum(quotient, rest / b[0])


@inlined
def square_root(a: DoubleDouble) -> DoubleDouble:
    """Return the square root; 0 for numbers that are not positive."""
    if a[0] <= 0.0:
        return 0.0, 0.0
    root = math.sqrt(a[0])
    rest = fused_multiply_add(-root, root, a[0]) + a[1]
    return fast_two_sum(root, 0.5 * rest / root)


@inlined
def is_less(a: DoubleDouble, b: DoubleDouble) -> bool:
    """Return whether a < b."""
    return a[0] < b[0] or (a[0] == b[0] and a[1] < b[1])
