"""Sums and products without any rounding, where a sign decides between something and nothing.

Numbers are sums of floats that do not overlap (Shewchuk, "Adaptive precision floating-point arithmetic and fast robust
geometric predicates", 1997): slow, and only asked when double-double cannot tell a value from 0.
"""

import numpy as np

from common.arrays import FloatArray
from robot_side.overlap.compile import building_block
from robot_side.overlap.double_double import two_product, two_sum
from robot_side.overlap.double_double_vectors import PreciseVector, highs, precise_cross, precise_dot
from robot_side.overlap.vectors import norm

_UNCERTAIN = 1e-29
"""Determinants below this, for vectors of length 1, are taken again without rounding."""


@building_block
def exact_sum(terms: FloatArray, count: int) -> float:
    """The sum of the first `count` terms, which are overwritten, to a relative error of 1e-15."""
    for term in range(1, count):
        rest = terms[term]
        for part in range(term):
            rest, terms[part] = two_sum(rest, terms[part])
        terms[term] = rest
    total = 0.0
    for term in range(count):
        total += terms[term]
    return total


@building_block
def exact_power(point: PreciseVector, radius: float) -> float:
    """R² - |point|² to a relative error of 1e-15."""
    terms = np.empty(20)
    terms[0], terms[1] = two_product(radius, radius)
    count = 2
    for axis in range(3):
        high, low = point[axis]
        terms[count], terms[count + 1] = two_product(-high, high)
        terms[count + 2], terms[count + 3] = two_product(-2.0 * high, low)
        terms[count + 4], terms[count + 5] = two_product(-low, low)
        count += 6
    return exact_sum(terms, count)


@building_block
def determinant(a: PreciseVector, b: PreciseVector, c: PreciseVector) -> float:
    """The determinant a · (b × c): 0 only where it is exactly 0, with its true sign elsewhere."""
    value = precise_dot(a, precise_cross(b, c))[0]
    if abs(value) > _UNCERTAIN * norm(highs(a)) * norm(highs(b)) * norm(highs(c)):
        return value
    return _exact_determinant(a, b, c)


@building_block
def _exact_determinant(a: PreciseVector, b: PreciseVector, c: PreciseVector) -> float:
    """The determinant a · (b × c) to a relative error of 1e-15."""
    terms = np.empty(192)
    count = 0
    for first in range(3):
        for cyclic in range(1, 3):
            second, third, sign = (first + cyclic) % 3, (first - cyclic) % 3, 3.0 - 2.0 * cyclic
            for choice in range(8):
                x, y, z = a[first][choice & 1], b[second][choice >> 1 & 1], c[third][choice >> 2]
                high, low = two_product(sign * x, y)
                terms[count], terms[count + 1] = two_product(high, z)
                terms[count + 2], terms[count + 3] = two_product(low, z)
                count += 4
    return exact_sum(terms, count)
