"""Transposition of rows to columns by vector instructions, four rows at a time; in kernels only.

LLVM would compile an ordinary loop to copies of single numbers. Then copying the pairs' numbers into columns would cost
as much as the bounds that are computed from them.
"""

from typing import Any

import numba
from llvmlite import ir

from common.arrays import FloatArray
from robot_side.compiled.kernel import intrinsic

_INDEX = ir.IntType(64)
_FOUR = ir.VectorType(ir.DoubleType(), 4)
_DOUBLE_BYTES = 8


def _four(
    rows: FloatArray, first: int, second: int, third: int, fourth: int, columns: FloatArray, end: int, apart: int
) -> None:
    for lane, start in enumerate((first, second, third, fourth)):
        columns[end + lane : end + lane + 3 * apart + 1 : apart] = rows[start : start + 4]


@intrinsic(_four)
def transpose_four(
    _typing: Any, rows: Any, _1: Any, _2: Any, _3: Any, _4: Any, columns: Any, _end: Any, _apart: Any
) -> Any:
    """Transpose four rows of four numbers.

    The rows begin at the indices `first` to `fourth` of the flat array `rows`. In the flat array `columns`, the first
    column's four numbers go to the indices from `end` on, the next column's to those `apart` farther, and so on.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, *starts, target, end, apart = arguments
        read, write = _access(context, builder, signature.args[0], source, signature.args[5], target)
        first, second, third, fourth = (read(start) for start in starts)
        even_low, odd_low = _pick(builder, first, second, 0, 4, 2, 6), _pick(builder, first, second, 1, 5, 3, 7)
        even_high, odd_high = _pick(builder, third, fourth, 0, 4, 2, 6), _pick(builder, third, fourth, 1, 5, 3, 7)
        write(_plus(builder, end, apart, 0), _pick(builder, even_low, even_high, 0, 1, 4, 5))
        write(_plus(builder, end, apart, 1), _pick(builder, odd_low, odd_high, 0, 1, 4, 5))
        write(_plus(builder, end, apart, 2), _pick(builder, even_low, even_high, 2, 3, 6, 7))
        write(_plus(builder, end, apart, 3), _pick(builder, odd_low, odd_high, 2, 3, 6, 7))
        return context.get_dummy_value()

    index = numba.types.int64
    return numba.types.void(rows, index, index, index, index, columns, index, index), generate


def _three(rows: FloatArray, start: int, columns: FloatArray, end: int, apart: int) -> None:
    for number in range(3):
        columns[end + number * apart : end + number * apart + 4] = rows[start + number : start + 12 : 3]


@intrinsic(_three)
def transpose_three(_typing: Any, rows: Any, _start: Any, columns: Any, _end: Any, _apart: Any) -> Any:
    """Transpose four rows of three numbers, from `start` on, into three columns, as `transpose_four` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, start, target, end, apart = arguments
        read, write = _access(context, builder, signature.args[0], source, signature.args[2], target)
        # x0 y0 z0 x1, y1 z1 x2 y2, z2 x3 y3 z3
        first, second, third = (read(builder.add(start, _INDEX(4 * part))) for part in range(3))
        picks = ((0, 3, 6, 6), (0, 1, 2, 5)), ((1, 4, 7, 7), (0, 1, 2, 6)), ((2, 5, 5, 5), (0, 1, 4, 7))
        for number, (low, high) in enumerate(picks):
            column = _pick(builder, _pick(builder, first, second, *low), third, *high)
            write(_plus(builder, end, apart, number), column)
        return context.get_dummy_value()

    index = numba.types.int64
    return numba.types.void(rows, index, columns, index, index), generate


def _access(context: Any, builder: Any, source_type: Any, source: Any, target_type: Any, target: Any) -> Any:
    """Return two functions: one reads four numbers from an index of `source`, one writes four at an index of `target`.

    Both arrays are flat.
    """
    pointers = [
        context.make_array(kind)(context, builder, array).data
        for kind, array in ((source_type, source), (target_type, target))
    ]

    def at(pointer: Any, index: Any) -> Any:
        return builder.bitcast(builder.gep(pointer, [index]), _FOUR.as_pointer())

    def read(index: Any) -> Any:
        numbers = builder.load(at(pointers[0], index))
        numbers.align = _DOUBLE_BYTES
        return numbers

    def write(index: Any, numbers: Any) -> None:
        builder.store(numbers, at(pointers[1], index)).align = _DOUBLE_BYTES

    return read, write


def _plus(builder: Any, start: Any, step: Any, count: int) -> Any:
    return builder.add(start, builder.mul(step, _INDEX(count)))


def _pick(builder: Any, first: Any, second: Any, *numbers: int) -> Any:
    """Return a vector of four numbers picked from two vectors; `numbers` are indices into both, one after the other."""
    return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(ir.IntType(32), 4), numbers))
