"""Queue of the next objects to examine, against Python's own heap."""

import heapq
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import compiled, input_array, output_indices
from robot_side.compiled.stack import on_stack
from robot_side.field.nearest_first import drop_first, push

DROP = math.nan
"""Stands in the list of keys for the order to remove the first item"""
MOST = 60
_heap, _items = on_stack(2 * MOST), on_stack(2 * MOST, dtype=np.int64)


@compiled(input_array(1), output_indices())
def _dropped(keys: FloatArray, dropped: IntArray) -> None:
    """Push each key and drop the first item at each `DROP`; write the dropped items in order."""
    heap, items, count, drops = _heap(), _items(), 0, 0
    for item in range(keys.size):
        if not math.isnan(keys[item]):
            count = push(heap, items, count, keys[item], item)
        elif count > 0:
            dropped[drops] = items[0]
            drops, count = drops + 1, drop_first(heap, items, count)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(keys=st.lists(st.one_of(st.just(DROP), st.floats(allow_nan=False)), max_size=MOST))
def test_the_item_with_the_least_key_is_always_the_next(keys: list[float]) -> None:
    # In the end all of them are dropped.
    keys = keys + [DROP] * len(keys)
    dropped, waiting, expected = np.full(len(keys), -1), list[float](), list[float]()
    _dropped(np.array(keys), dropped)
    for key in keys:
        if not math.isnan(key):
            heapq.heappush(waiting, key)
        elif waiting:
            expected.append(heapq.heappop(waiting))
    found = dropped[: len(expected)].tolist()
    assert [keys[item] for item in found] == expected
    assert len(set(found)) == len(found)
    assert (dropped[len(expected) :] == -1).all()
