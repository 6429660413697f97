"""Differences, sums of products and determinants of doubles, almost without intermediate rounding errors.

Numbers and vectors here may have two parts: the rounded value, and the `rest` that was lost by rounding.
"""

from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, cross, dot
from robot_side.overlap.digits.double_double import two_product, two_sum


@inlined
def difference(a: Vector, b: Vector) -> tuple[Vector, Vector]:
    """Return a - b exactly, as (rounded vector, rest)."""
    x, y, z = two_sum(a[0], -b[0]), two_sum(a[1], -b[1]), two_sum(a[2], -b[2])
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


@inlined
def sum_of_products(start: float, start_rest: float, factors: Vector, others: Vector, other_rests: Vector) -> float:
    """Return start + Σ factorᵢ·otherᵢ, right to the last digit of the sum, even if the terms are much larger.

    start_rest, other_rests: the parts of `start` and `others` that were lost by rounding.
    """
    total, rest = start, start_rest
    for i in range(3):
        product, product_rest = two_product(factors[i], others[i])
        total, left = two_sum(total, product)
        rest += (product_rest + left) + factors[i] * other_rests[i]
    return total + rest


@inlined
def determinant(a: Vector, b: Vector, c: Vector, a_rest: Vector, b_rest: Vector, c_rest: Vector) -> float:
    """Return a · (b × c), correct to the last digits unless all but 1e-15 of the products cancels.

    a_rest, b_rest, c_rest: the parts of the vectors that were lost by rounding.
    """
    x, x_rest = _product_difference(b[1], c[2], b[2], c[1])
    y, y_rest = _product_difference(b[2], c[0], b[0], c[2])
    z, z_rest = _product_difference(b[0], c[1], b[1], c[0])
    u, u_rest = two_product(a[0], x)
    v, v_rest = two_product(a[1], y)
    w, w_rest = two_product(a[2], z)
    uv, uv_rest = two_sum(u, v)
    total, rest = two_sum(uv, w)
    rest += (uv_rest + (u_rest + v_rest + w_rest)) + dot(a, (x_rest, y_rest, z_rest))
    rest += dot(a_rest, (x, y, z)) + (dot(b_rest, cross(c, a)) + dot(c_rest, cross(a, b)))
    return total + rest


@inlined
def _product_difference(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    ab, ab_rest = two_product(a, b)
    cd, cd_rest = two_product(c, d)
    total, rest = two_sum(ab, -cd)
    return total, rest + (ab_rest - cd_rest)
