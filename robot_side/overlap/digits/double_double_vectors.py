"""Vectors of three double-double numbers, as tuples or as rows of arrays (n, 3, 2)."""

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector
from robot_side.overlap.digits.double_double import (
    DoubleDouble,
    divided,
    minus,
    negated,
    plus,
    square_root,
    times,
)

PreciseVector = tuple[DoubleDouble, DoubleDouble, DoubleDouble]


@inlined
def load_number(array: FloatArray, row: int) -> DoubleDouble:
    """Return the double-double number that `store_number` put into row `row` of an (n, 3, 2) array."""
    return array[row, 0, 0], array[row, 0, 1]


@inlined
def store_number(array: FloatArray, row: int, value: DoubleDouble) -> None:
    """Put one double-double number into row `row` of an (n, 3, 2) array; the rest of the row is unused."""
    array[row, 0, 0] = value[0]
    array[row, 0, 1] = value[1]


@inlined
def load_vector(array: FloatArray, row: int) -> PreciseVector:
    """Return row `row` of an (n, 3, 2) array."""
    return (
        (array[row, 0, 0], array[row, 0, 1]),
        (array[row, 1, 0], array[row, 1, 1]),
        (array[row, 2, 0], array[row, 2, 1]),
    )


@inlined
def store_vector(array: FloatArray, row: int, value: PreciseVector) -> None:
    """Put a vector into row `row` of an (n, 3, 2) array."""
    for axis in range(3):
        array[row, axis, 0] = value[axis][0]
        array[row, axis, 1] = value[axis][1]


@inlined
def highs(a: PreciseVector) -> Vector:
    """Return the vector rounded to floats."""
    return a[0][0], a[1][0], a[2][0]


@inlined
def precise_negative(a: PreciseVector) -> PreciseVector:
    """Return -a."""
    return negated(a[0]), negated(a[1]), negated(a[2])


@inlined
def precise_add(a: PreciseVector, b: PreciseVector) -> PreciseVector:
    """Return the sum a + b."""
    return plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2])


@inlined
def precise_subtract(a: PreciseVector, b: PreciseVector) -> PreciseVector:
    """Return the difference a - b."""
    return minus(a[0], b[0]), minus(a[1], b[1]), minus(a[2], b[2])


@inlined
def precise_scale(factor: DoubleDouble, a: PreciseVector) -> PreciseVector:
    """Return the product factor · a."""
    return times(factor, a[0]), times(factor, a[1]), times(factor, a[2])


@building_block
def precise_dot(a: PreciseVector, b: PreciseVector) -> DoubleDouble:
    """Return the scalar product a · b."""
    return plus(plus(times(a[0], b[0]), times(a[1], b[1])), times(a[2], b[2]))


@building_block
def precise_cross(a: PreciseVector, b: PreciseVector) -> PreciseVector:
    """Return the vector product a × b."""
    return (
        minus(times(a[1], b[2]), times(a[2], b[1])),
        minus(times(a[2], b[0]), times(a[0], b[2])),
        minus(times(a[0], b[1]), times(a[1], b[0])),
    )


@building_block
def precise_unit(a: PreciseVector) -> tuple[PreciseVector, DoubleDouble]:
    """Return (a / |a|, |a|); the vector is 0 if |a| is 0 or underflows to 0."""
    length = square_root(precise_dot(a, a))
    if length[0] == 0.0:
        return ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0)), length
    return precise_scale(divided((1.0, 0.0), length), a), length
