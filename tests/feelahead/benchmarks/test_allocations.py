"""What a tick allocates is counted where it is asked for, and what stays is known."""

import numpy as np
import pytest

from common.errors import ConfigurationError
from feelahead.benchmarks.tick.allocations import Allocations, Line, allocations, goals, tables
from feelahead.benchmarks.tick.array_memory import ArrayMemory, counted
from feelahead.benchmarks.tick.bench import bench_tick


def test_each_request_is_counted_at_the_line_that_makes_it() -> None:
    memory = ArrayMemory()
    outside = np.zeros(7)
    with counted(memory):
        kept = [np.empty(3) for _ in range(5)]
        whole = np.zeros((10, 10))
        outside[0] = 1.0
    after = np.ones(1000)
    [(some, five), (other, one)] = memory.times.most_common()
    assert some[0] == other[0] == __file__
    assert (five, one) == (5, 1)
    assert (memory.size_bytes[some], memory.size_bytes[other]) == (5 * 24, 800)
    # What was made meanwhile is as good as any array.
    whole += len(kept)
    assert whole.sum() == 500.0
    assert after.sum() == 1000.0


def test_no_arrays_stay_and_memory_is_told_at_ten_points() -> None:
    found = allocations(300, objects=200, moving=5)
    assert len(found.resident_mb) == 11
    assert min(found.resident_mb) > 10.0
    assert found.kept_bytes < 100.0
    assert found.ticks == 3_200
    assert any(line.place.startswith("robot_side/") for line in found.lines)
    assert "all" in tables(found)[1].rows[-1]


def test_what_is_promised_is_told_apart_from_what_is_not() -> None:
    flat = Allocations(10_000, (90.0, 100.0, 101.0), 0.0, ())
    leaking = Allocations(10_000, (90.0, 100.0, 110.0), 500.0, (Line("core.py:1", 2.0, 48.0),))
    assert [goal.verdict for goal in goals(flat)] == ["met"] * 3
    assert [goal.verdict for goal in goals(leaking)] == ["missed"] * 3


def test_too_few_ticks_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="--allocations 1"):
        bench_tick(["--allocations", "1"])
