"""One kernel calls another by its address."""

from typing import Any

import numba
import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.compiled.calls import call_at_address
from robot_side.compiled.kernel import COUNT, NUMBER, compiled, input_array, output_array


@compiled(input_array(2), output_array(1), NUMBER, returns=COUNT)
def _row_sums(rows: FloatArray, sums: FloatArray, factor: float) -> int:
    for row in range(len(rows)):
        sums[row] = factor * rows[row].sum()
    return len(rows)


_call = call_at_address(COUNT, (input_array(2), output_array(1), NUMBER))


@compiled(COUNT, input_array(2), output_array(1), returns=COUNT)
def _sums_but_first(address: int, rows: FloatArray, sums: FloatArray) -> int:
    count: int = _call(address, (rows[1:], sums[1:], 2.0))
    return count


@compiled(COUNT, output_array(2), output_array(1), returns=COUNT)
def _sums_of_writable(address: int, rows: FloatArray, sums: FloatArray) -> int:
    count: int = _call(address, (rows, sums, 1.0))
    return count


def test_the_called_kernel_reads_and_fills_the_callers_arrays() -> None:
    rows, sums = np.arange(12.0).reshape(4, 3), np.full(4, -1.0)
    assert _sums_but_first(_row_sums.address, rows, sums) == 3
    np.testing.assert_array_equal(sums, [-1.0, *(2.0 * rows[1:].sum(axis=1))])


def test_a_writable_array_is_passed_where_one_is_only_read() -> None:
    rows, sums = np.ones((2, 3)), np.zeros(2)
    assert _sums_of_writable(_row_sums.address, rows, sums) == 2
    np.testing.assert_array_equal(sums, [3.0, 3.0])


def test_arguments_of_other_types_are_refused_as_the_caller_is_compiled() -> None:
    def with_too_few_dimensions(address: int, rows: FloatArray, sums: FloatArray) -> Any:
        return _call(address, (rows, sums, 1.0))

    def with_too_few_arguments(address: int, rows: FloatArray, _sums: FloatArray) -> Any:
        return _call(address, (rows,))

    for caller in (with_too_few_dimensions, with_too_few_arguments):
        with pytest.raises(numba.TypingError, match="the kernel takes"):
            numba.njit(caller)(_row_sums.address, np.ones(3), np.ones(3))
