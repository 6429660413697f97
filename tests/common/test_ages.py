import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.silence import counted_s
from common.timing.ages import LoopAge, QueueingAge

delays = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=100)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.001, 0.02))
def test_a_silence_counts_but_for_what_the_deadbands_allow(silent_s: float, longer_s: float, turn_s: float) -> None:
    counted = counted_s(silent_s, turn_s)
    assert counted == pytest.approx(min(silent_s, turn_s) + max(silent_s - 0.02, 0.0))
    assert counted - 1e-12 <= counted_s(silent_s + longer_s, turn_s) <= counted + longer_s + 1e-12


def test_loop_age_is_the_worst_case_until_known_and_after_reset() -> None:
    loop_age = LoopAge(worst_case_s=0.5)
    assert loop_age.value(0.0) == 0.5
    assert loop_age.value(1e6) == 0.5
    for tick in range(10_000):
        loop_age.update(0.020, 1e-3 * tick)
    assert loop_age.value(10.0) == pytest.approx(0.020)
    loop_age.reset()
    assert loop_age.value(10.0) == 0.5
    assert loop_age.value(1e6) == 0.5


def test_loop_age_is_settled_when_the_worst_case_has_died_away() -> None:
    loop_age = LoopAge(worst_case_s=1.0, time_constant_s=0.5)
    assert not loop_age.settled(100.0)
    loop_age.update(0.020, 100.0)
    first = next(now_s for now_s in np.arange(100.0, 110.0, 0.1) if loop_age.settled(now_s))
    assert loop_age.value(first) < 0.030
    loop_age.update(0.5, first)
    assert loop_age.settled(first)
    loop_age.reset()
    assert not loop_age.settled(first + 10.0)


@pytest.mark.parametrize("elapsed_s", [0.0, 0.1, 0.5, 3.0])
def test_loop_age_falls_exponentially(elapsed_s: float) -> None:
    loop_age = LoopAge(worst_case_s=0.4, window_s=1e-9, time_constant_s=0.5)
    loop_age.update(0.100, 10.0)
    expected_s = 0.100 + 0.300 * math.exp(-elapsed_s / 0.5)
    assert loop_age.value(10.0 + elapsed_s) == pytest.approx(expected_s, rel=1e-12)


@given(delays)
def test_loop_age_never_lies_below_the_quantile_or_rises_by_waiting(ages_s: list[float]) -> None:
    loop_age = LoopAge(worst_case_s=0.2, probability=0.5, window_s=0.045)
    for tick, age_s in enumerate(ages_s):
        now_s = 0.01 * tick
        loop_age.update(age_s, now_s)
        median_s = np.quantile(ages_s[max(0, tick - 4) : tick + 1], 0.5, method="inverted_cdf")
        values_s = [loop_age.value(now_s + later_s) for later_s in (0.0, 0.1, 1.0, 60.0)]
        assert values_s == sorted(values_s, reverse=True)
        assert values_s[-1] == pytest.approx(median_s, abs=1e-12)


@given(delays, st.floats(-1e5, 1e5))
def test_age_is_what_exceeds_the_least_delay_whatever_the_clocks_offset(delays_s: list[float], offset_s: float) -> None:
    queueing = QueueingAge()
    for number, delay_s in enumerate(delays_s):
        received_s = 0.01 * number
        age_s = queueing.update(received_s - delay_s + offset_s, received_s)
        assert age_s == pytest.approx(delay_s - min(delays_s[: number + 1]), abs=1e-9)


def test_a_longer_way_stops_ageing_after_the_window() -> None:
    queueing = QueueingAge()
    ages_s = {}
    for number in range(8000):
        sent_s = 0.004 * number
        delay_s = 0.020 if sent_s < 5.0 else 0.070
        ages_s[number] = queueing.update(sent_s, sent_s + delay_s)
    assert ages_s[round(14.8 / 0.004)] == pytest.approx(0.050)
    assert ages_s[round(15.3 / 0.004)] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("pause_s", [2.0, 60.0])
def test_a_backlog_after_a_pause_is_old_however_long_the_pause(pause_s: float) -> None:
    queueing = QueueingAge()
    for number in range(1000):
        queueing.update(0.004 * number, 0.004 * number + 0.001)
    backlog_s = [4.0 + 0.004 * number for number in range(100)]
    for sent_s in backlog_s:
        assert queueing.update(sent_s, 4.0 + pause_s) == pytest.approx(4.0 + pause_s - sent_s - 0.001)


def test_what_cannot_be_is_refused_and_changes_nothing() -> None:
    loop_age = LoopAge(worst_case_s=0.1)
    for age_s in (-1e-9, math.nan, math.inf):
        with pytest.raises(ValueError, match="age_s = "):
            loop_age.update(age_s, 0.0)
    assert loop_age.value(0.0) == 0.1
    for worst_case_s in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="worst_case_s = "):
            LoopAge(worst_case_s)
    with pytest.raises(ValueError, match="sent_s = nan"):
        QueueingAge().update(math.nan, 0.0)
