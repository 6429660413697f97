import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.statistics import RESERVOIR_SIZE, RunningStatistics, SlidingMinimum, SlidingQuantile

samples = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=200)


def test_without_samples_everything_is_absent() -> None:
    empty = RunningStatistics(0)
    assert empty.count == 0
    assert [empty.mean, empty.sd, empty.minimum, empty.maximum, empty.quantile(0.5)] == [None] * 5
    assert empty.summary_ms() == dict.fromkeys(("mean", "sd", "p50", "p95", "p99"))


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2000), st.sets(st.integers(0, 1999), max_size=5))
def test_asking_in_between_changes_nothing(values: list[float], asked_at: set[int]) -> None:
    quiet, asked = RunningStatistics(0), RunningStatistics(0)
    for position, value in enumerate(values):
        quiet.add(value)
        asked.add(value)
        if position in asked_at:
            assert asked.mean == pytest.approx(np.mean(values[: position + 1]), rel=1e-12, abs=1e-9)
    assert quiet.mean == pytest.approx(np.mean(values), rel=1e-12, abs=1e-9)
    assert asked.mean == pytest.approx(quiet.mean, rel=1e-12, abs=1e-9)
    assert quiet.sd == pytest.approx(np.std(values, ddof=1), rel=1e-12, abs=1e-9)
    assert asked.sd == pytest.approx(quiet.sd, rel=1e-12, abs=1e-9)
    assert (asked.count, asked.minimum, asked.maximum) == (len(values), min(values), max(values))
    assert asked.quantile(0.37) == quiet.quantile(0.37) == np.quantile(values, 0.37)


@given(st.lists(st.lists(st.floats(-1e6, 1e6), max_size=700), max_size=4))
def test_many_at_once_are_as_good_as_one_by_one(blocks: list[list[float]]) -> None:
    together, single = RunningStatistics(0), RunningStatistics(0)
    for block in blocks:
        together.extend(block)
        for value in block:
            single.add(value)
    assert (together.count, together.minimum, together.quantile(0.5)) == (
        single.count,
        single.minimum,
        single.quantile(0.5),
    )
    assert together.mean == (None if single.mean is None else pytest.approx(single.mean, rel=1e-12, abs=1e-9))


def test_the_reservoir_is_the_same_whenever_it_is_asked() -> None:
    quiet, asked = RunningStatistics(3), RunningStatistics(3)
    for value in range(RESERVOIR_SIZE + 20_000):
        quiet.add(value)
        asked.add(value)
        if value % 1777 == 0:
            assert asked.maximum == value
    for probability in (0.1, 0.37, 0.9):
        assert asked.quantile(probability) == quiet.quantile(probability)


def test_numbers_beyond_any_sum_do_no_harm() -> None:
    running = RunningStatistics(0)
    for _ in range(3):
        running.add(1.5e308)
    assert running.mean == pytest.approx(1.5e308)
    running.add(-1.5e308)
    assert (running.minimum, running.maximum, running.count) == (-1.5e308, 1.5e308, 4)
    assert running.sd is not None


def test_quantiles_of_a_long_run_cover_all_of_it() -> None:
    count = 3 * RESERVOIR_SIZE
    running = RunningStatistics(1)
    for value in range(count):
        running.add(value)
    assert running.count == count
    for probability in (0.05, 0.50, 0.95):
        sd = count * math.sqrt(probability * (1.0 - probability) / RESERVOIR_SIZE)
        assert running.quantile(probability) == pytest.approx(probability * count, abs=4.0 * sd)


def test_what_is_no_number_no_probability_or_no_window_is_refused() -> None:
    running, sliding = RunningStatistics(0), SlidingQuantile()
    refused: list[tuple[str, Callable[[], object]]] = [("window_s = 0", lambda: SlidingQuantile(window_s=0.0))]
    for value in (math.nan, math.inf, -math.inf):
        refused += [("value = ", partial(running.add, value)), ("value = ", partial(sliding.update, value, 0.0))]
        refused += [("values", partial(running.extend, [1.0, value]))]
    for p in (-0.01, 1.01, math.nan):
        refused += [("probability = ", partial(one, probability=p)) for one in (running.quantile, SlidingQuantile)]
    for said, call in refused:
        with pytest.raises(ValueError, match=said):
            call()
    assert (running.count, sliding.value) == (0, None)


@given(samples, st.integers(1, 50), st.sampled_from([0.05, 0.25, 0.5, 0.75, 0.95, 1.0]))
def test_sliding_quantile_agrees_with_numpy(values: list[float], window: int, probability: float) -> None:
    sliding = SlidingQuantile(float(window), probability)
    for position, value in enumerate(values):
        sliding.update(value, float(position))
        newest = values[max(0, position + 1 - window) : position + 1]
        assert sliding.value == np.quantile(newest, probability, method="inverted_cdf")


def test_sliding_quantile_forgets_on_request() -> None:
    sliding = SlidingQuantile(window_s=3.0)
    for value in (1.0, 2.0, 3.0, 4.0):
        sliding.update(value, value)
    sliding.clear()
    assert sliding.value is None
    sliding.update(0.5, 5.0)
    assert sliding.value == 0.5


@given(
    st.lists(st.tuples(st.integers(0, 3), st.integers(0, 9)), min_size=1, max_size=200),
    st.integers(1, 8),
)
def test_sliding_minimum_agrees_with_the_whole_window(steps: list[tuple[int, int]], span: int) -> None:
    minimum, seen, position = SlidingMinimum(span), list[tuple[int, int]](), 0
    assert minimum.value is None
    for step, value in steps:
        position += step
        seen.append((position, value))
        expected = min(other for place, other in seen if place > position - span)
        assert minimum.update(position, value) == expected
        assert minimum.value == expected
        assert len(minimum) <= span
