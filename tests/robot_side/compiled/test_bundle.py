"""Arrays that go to a kernel by their addresses arrive as they are, and are filled in place."""

import numpy as np
import pytest

from common.arrays import FloatArray, IntArray
from robot_side.compiled.bundle import BUNDLE, addresses, flags, indices, matrices, numbers, records, rows
from robot_side.compiled.kernel import compiled, output_array

THING = np.dtype([("name", np.int64), ("size", np.float64)])


@compiled(BUNDLE, output_array(1))
def _read_all(bundle: IntArray, found: FloatArray) -> None:
    things, table, flagged = records(bundle, 0, THING), rows(bundle, 1, 4), flags(bundle, 5)
    found[0], found[1] = things.size, things[1].size
    found[2], found[3] = table.shape[0], table[1, 2]
    found[4], found[5] = numbers(bundle, 2)[2], indices(bundle, 3)[1]
    found[6], found[7] = matrices(bundle, 4, 3, 2)[1, 2, 1], flagged[0] + 2 * flagged[1]
    things[0].name = 7
    table[0, 3] = -1.0


def test_arrays_of_every_kind_are_read_and_filled() -> None:
    things, table = np.zeros(2, dtype=THING), np.arange(8.0).reshape(2, 4)
    things["size"] = 3.5, 4.5
    others = np.array([0.1, 0.2, 0.3]), np.array([10, 20]), np.arange(12.0).reshape(2, 3, 2), np.array([True, False])
    found = np.zeros(8)
    _read_all(addresses(things, table, *others), found)
    assert found.tolist() == [2.0, 4.5, 2.0, 6.0, 0.3, 20.0, 11.0, 1.0]
    assert things["name"].tolist() == [7, 0]
    assert table[0].tolist() == [0.0, 1.0, 2.0, -1.0]


def test_arrays_with_gaps_are_refused() -> None:
    with pytest.raises(ValueError, match="C-contiguous"):
        addresses(np.zeros((4, 4))[:, :3])
