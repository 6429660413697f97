"""Choice of a loop's period, in virtual time."""

from collections.abc import Callable, Iterator
from itertools import islice, pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.periods import PERIODS_S, TURN_S
from common.realtime.pacing import Pacer
from common.realtime.period_choice import PATIENCE_S, WINDOW_S, PeriodChoice

ASKED = st.sampled_from(PERIODS_S) | st.floats(PERIODS_S[0], PERIODS_S[-1])
Worked = Callable[[float, float], float]
"""Function of the time and the period that returns for how long a turn works, in seconds"""


def periods(asked_s: float, works: Worked) -> Iterator[tuple[float, float]]:
    """Yield (time, period) after each turn of a loop that keeps to a pacer; time is in seconds since the start."""
    pacer, choice, now_s = Pacer(asked_s, 0.0), PeriodChoice(asked_s), 0.0
    while True:
        now_s = max(now_s, pacer.deadline_s)
        pacer.begin(now_s)
        worked_s = works(now_s, pacer.period_s)
        now_s += worked_s
        if choice.turned(pacer.late_s, worked_s, pacer.missed, now_s) and choice.period_s != pacer.period_s:
            pacer.change(choice.period_s)
        yield now_s, pacer.period_s


def until(end_s: float, asked_s: float, works: Worked) -> list[tuple[float, float]]:
    """Return (time, period) of the start and of each change until `end_s`."""
    changes = [(0.0, asked_s)]
    for now_s, period_s in periods(asked_s, works):
        if period_s != changes[-1][1]:
            changes.append((now_s, period_s))
        if now_s > end_s:
            return changes
    raise AssertionError


@given(ASKED, st.lists(st.floats(0.0, 0.06), min_size=1, max_size=50), st.integers(0, 3000))
@settings(max_examples=50, deadline=None)
def test_only_the_period_asked_for_and_longer_ones_are_taken_a_step_at_a_time(
    asked_s: float, works_s: list[float], turns: int
) -> None:
    left = iter(works_s * (1 + turns // len(works_s)))
    found = [asked_s, *(period_s for _, period_s in islice(periods(asked_s, lambda *_: next(left)), turns))]
    allowed = PeriodChoice(asked_s).periods_s
    assert allowed[0] == asked_s
    assert list(allowed[1:]) == [period_s for period_s in PERIODS_S if period_s > asked_s]
    for before_s, after_s in pairwise(found):
        assert abs(allowed.index(after_s) - allowed.index(before_s)) <= 1


@given(ASKED, st.floats(0.0, 0.99), st.floats(0.0, 0.2), st.integers(400, 1000))
@settings(max_examples=30, deadline=None)
def test_turns_that_fit_and_rare_pauses_change_nothing(
    asked_s: float, share: float, pause_s: float, every: int
) -> None:
    count = iter(range(10**9))
    found = until(20.0, asked_s, lambda _, period_s: share * period_s + (pause_s if next(count) % every == 7 else 0.0))
    # A pause that takes a twentieth of the time may be one too many.
    assert len(found) == 1 or pause_s / (every * asked_s) > 0.02


@given(st.floats(1e-3, 0.0195))
@settings(max_examples=30, deadline=None)
def test_the_first_period_that_holds_the_work_is_found_soon_and_kept(works_s: float) -> None:
    found = until(100.0, PERIODS_S[0], lambda *_: works_s)
    fits_s = next(period_s for period_s in PERIODS_S if period_s * 1.03 >= works_s)
    ends_s = next(period_s for period_s in PERIODS_S if period_s >= works_s)
    assert found[-1][1] in (fits_s, ends_s)
    assert found[-1][0] <= 1.1 * WINDOW_S * len(PERIODS_S)
    assert [period_s for _, period_s in found] == sorted(period_s for _, period_s in found)


def test_it_goes_back_when_turns_have_fitted_for_a_while() -> None:
    found = until(120.0, TURN_S, lambda now_s, _: 0.009 if now_s < 20.0 else 0.001)
    assert [period_s for _, period_s in found] == [0.004, 0.005, 0.008, 0.010, 0.008, 0.005, 0.004]
    back_s = [time_s for time_s, _ in found[4:]]
    assert back_s[0] >= 20.0 + PATIENCE_S - WINDOW_S
    assert all(later_s - earlier_s >= PATIENCE_S for earlier_s, later_s in pairwise(back_s))


def test_what_fails_again_and_again_is_tried_more_and_more_seldom() -> None:
    """A limit on processor time stops only who takes more: at the longer period all seems well."""
    found = until(3000.0, TURN_S, lambda _, period_s: 0.0045 if period_s < 0.005 else 0.0005)
    tried_s = [time_s for time_s, period_s in found if period_s == TURN_S][1:]
    waits_s = [later_s - earlier_s for earlier_s, later_s in pairwise(tried_s)]
    assert len(tried_s) < 10
    assert all(later_s > 1.7 * earlier_s for earlier_s, later_s in pairwise(waits_s[:6]))


@pytest.mark.parametrize("pauses", [1, 3])
def test_a_few_pauses_however_long_are_no_reason(pauses: int) -> None:
    left = iter([3.0] * pauses)
    assert len(until(60.0, TURN_S, lambda now_s, _: next(left, 1e-3) if now_s > 10.0 else 1e-3)) == 1
