"""Arrays in a kernel's own frame: of the shape and type that was asked, each place its own."""

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import NUMBER, building_block, compiled, output_array
from robot_side.compiled.stack import on_stack

_table, _counts = on_stack(2, 3), on_stack(4, dtype=np.int64)


@building_block
def _sum_of_squares(count: int) -> float:
    table, total = _table(), 0.0
    for i in range(6):
        table[i // 3, i % 3] = float(i + count)
    for i in range(2):
        for j in range(3):
            total += table[i, j] * table[i, j]
    return total


@compiled(NUMBER, output_array(1))
def _fill(number: float, found: FloatArray) -> None:
    first, second, counts = _table(), _table(), _counts()
    for i in range(4):
        counts[i] = i
    first[1, 2], second[1, 2] = number, 2.0 * number
    found[0] = _sum_of_squares(int(number))
    found[1], found[2], found[3] = first[1, 2], second[1, 2], counts.sum()
    found[4], found[5], found[6] = first.shape[0], first.shape[1], counts.size


def test_a_kernel_and_a_function_that_it_calls_have_arrays_of_their_own() -> None:
    found = np.zeros(7)
    _fill(3.0, found)
    assert found.tolist() == [sum(i * i for i in range(3, 9)), 3.0, 6.0, 6.0, 2.0, 3.0, 4.0]
