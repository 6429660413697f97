"""Exact sums and products, for values whose sign decides whether there is any overlap.

Repeated two-sums gather the terms of a sum in the last one (Ogita, Rump and Oishi, "Accurate sum and dot product",
2005). This is slow, so it is used only where double-double cannot distinguish a value from 0.
"""

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block
from robot_side.compiled.stack import on_stack
from robot_side.compiled.vectors import norm
from robot_side.overlap.digits.double_double import two_product, two_sum
from robot_side.overlap.digits.double_double_vectors import PreciseVector, highs, precise_cross, precise_dot

_UNCERTAIN = 1e-15
"""Size of a determinant of vectors of length 1, below which it is computed again without rounding"""
_power_terms, _determinant_terms = on_stack(20), on_stack(192)


@building_block
def exact_sum(terms: FloatArray) -> float:
    """Return the sum of the terms with a relative error of 1e-15; the terms are overwritten."""
    for _ in range(terms.size):
        # Each pass keeps the sum and gathers it in the last term.
        rest = 0.0
        for term in range(1, terms.size):
            terms[term], terms[term - 1] = two_sum(terms[term], terms[term - 1])
            rest += abs(terms[term - 1])
        if rest <= 1e-16 * abs(terms[-1]):
            break
    return float(terms[-1])


@building_block
def exact_power(point: PreciseVector, radius: float) -> float:
    """Return R² - |point|² with a relative error of 1e-15."""
    terms = _power_terms()
    terms[0], terms[1] = two_product(radius, radius)
    count = 2
    for axis in range(3):
        high, low = point[axis]
        terms[count], terms[count + 1] = two_product(-high, high)
        terms[count + 2], terms[count + 3] = two_product(-2.0 * high, low)
        terms[count + 4], terms[count + 5] = two_product(-low, low)
        count += 6
    return exact_sum(terms)


@building_block
def determinant(a: PreciseVector, b: PreciseVector, c: PreciseVector) -> float:
    """Return the determinant a · (b × c) with a relative error of 1e-15: 0 only if it is exactly 0."""
    value = precise_dot(a, precise_cross(b, c))[0]
    if abs(value) > _UNCERTAIN * norm(highs(a)) * norm(highs(b)) * norm(highs(c)):
        return value
    return _exact_determinant(a, b, c)


@building_block
def _exact_determinant(a: PreciseVector, b: PreciseVector, c: PreciseVector) -> float:
    """Return the determinant a · (b × c) with a relative error of 1e-15."""
    terms = _determinant_terms()
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
    return exact_sum(terms)
