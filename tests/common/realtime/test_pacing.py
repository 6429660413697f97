"""Deadlines of a loop's turns, in virtual time: nothing here sleeps or reads a real clock."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.clock import VirtualClock
from common.realtime.pacing import Pacer, wait_for_turn

PERIOD_S = 1e-3


@given(st.lists(st.floats(0.0, 0.02), min_size=1, max_size=200), st.floats(1e-4, 0.1), st.floats(-1e3, 1e6))
def test_every_deadline_is_taken_or_counted_once(late_s: list[float], period_s: float, start_s: float) -> None:
    pacer = Pacer(period_s, start_s)
    for late in late_s:
        before_s = pacer.deadline_s
        now_s = before_s + late
        pacer.begin(now_s)
        assert pacer.deadline_s > now_s
        assert pacer.deadline_s <= now_s + period_s * (1 + 1e-6) + 1e-9
    taken = round((pacer.deadline_s - start_s) / period_s)
    assert pacer.turns + pacer.overruns == taken


@given(st.lists(st.tuples(st.floats(0.0, 0.02), st.sampled_from([1e-3, 4e-3, 0.02])), min_size=1, max_size=50))
def test_another_period_begins_at_the_next_deadline(turns: list[tuple[float, float]]) -> None:
    pacer = Pacer(PERIOD_S, 7.0)
    for late_s, period_s in turns:
        pacer.begin(pacer.deadline_s + late_s)
        assert pacer.late_s == pytest.approx(late_s, abs=1e-9)
        next_s = pacer.deadline_s
        pacer.change(period_s)
        assert pacer.deadline_s == next_s
        pacer.begin(next_s)
        assert pacer.missed == 0
        assert pacer.deadline_s == pytest.approx(next_s + period_s)
        told = pacer.summary()
        assert (told["period_ms"], told["period_changes"][-1]["period_ms"]) == (1e3 * period_s, 1e3 * period_s)
        assert told["period_changes"][-1]["time_s"] == pytest.approx(next_s - 7.0)


def test_refuses_to_begin_before_its_time_and_odd_periods() -> None:
    pacer = Pacer(PERIOD_S, 1.0)
    assert not pacer.due(0.999)
    assert pacer.due(1.0)
    for early_s in (0.999, math.nan):
        with pytest.raises(ValueError, match="deadline"):
            pacer.begin(early_s)
    for period_s in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="period_s"):
            Pacer(period_s, 0.0)


class Waiting:
    """Stand-in for the sockets' `wait`, in virtual time: each wait ends `late_s` late, or when a message comes."""

    def __init__(self, clock: VirtualClock, late_s: float = 0.0, message_s: float = math.inf) -> None:
        self.slept_s: list[float] = []
        self._clock, self._late_s, self._message_s = clock, late_s, message_s

    def wait(self, timeout_s: float) -> bool:
        if timeout_s > 0.0:
            self.slept_s.append(timeout_s)
            self._clock.advance_to(min(self._clock.now() + timeout_s + self._late_s, self._message_s))
        else:
            self._clock.advance_to(self._clock.now() + 1e-6)
        return self._clock.now() >= self._message_s


@pytest.mark.parametrize(
    ("late_s", "message_s", "other_s", "ends_s"),
    [
        (150e-6, math.inf, 950e-6, 950e-6),  # a sleep that ends late does not delay a message of an emulated link
        (150e-6, math.inf, math.inf, PERIOD_S + 150e-6),
        *((0.0, message_s, math.inf, message_s) for message_s in (300e-6, 900e-6)),
        *((0.0, math.inf, other_s, min(other_s, PERIOD_S)) for other_s in (300e-6, 950e-6, 5e-3)),
    ],
)
def test_a_wait_ends_with_a_message_or_what_is_due_first(
    late_s: float, message_s: float, other_s: float, ends_s: float
) -> None:
    clock = VirtualClock()
    waiting = Waiting(clock, late_s, message_s)
    wait_for_turn(Pacer(PERIOD_S, PERIOD_S), clock, waiting.wait, other_s)
    assert clock.now() == pytest.approx(ends_s, abs=2e-6)
    # The last 200 us before a release are not slept.
    assert waiting.slept_s in ([], [pytest.approx(other_s - 200e-6 if other_s < PERIOD_S else PERIOD_S)])


def test_what_is_overdue_does_not_wait() -> None:
    clock = VirtualClock(1.0)
    waiting = Waiting(clock)
    wait_for_turn(Pacer(PERIOD_S, 0.5), clock, waiting.wait, 0.4)
    wait_for_turn(Pacer(PERIOD_S, 2.0), clock, waiting.wait, 0.4)
    assert waiting.slept_s == []
    assert clock.now() <= 1.0 + 2e-6
