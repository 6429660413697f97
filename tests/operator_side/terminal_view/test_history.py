import math

import msgspec
import pytest

from operator_side.facts import OperatorFacts
from operator_side.terminal_view.history import SPAN_S, History
from tests.operator_side.terminal_view.made_up_facts import PULLED, facts_of


def at(now_s: float, newest_ms: float | None = None, **status: float) -> OperatorFacts:
    facts = facts_of(now_s, PULLED, **status)
    return msgspec.structs.replace(facts, to_operator=msgspec.structs.replace(facts.to_operator, newest_ms=newest_ms))


def test_a_step_shows_the_most_that_was_in_it() -> None:
    history = History()
    for tick in range(1, 201):
        history.add(at(tick / 10.0, 40.0 + tick % 10))
    delay, stiffness, overlap, tick_time = history.curves(20)
    assert delay.values == [49.0] * 20
    assert delay.newest == 40.0
    assert delay.top == 49.0
    assert stiffness.values == [0.31] * 20
    assert stiffness.top == overlap.top == 1.0
    assert tick_time.newest == 140.0


def test_what_is_too_old_is_gone() -> None:
    history = History()
    history.add(at(0.0, 500.0))
    history.add(at(SPAN_S + 1.0, 5.0))
    assert [value for value in history.curves(40)[0].values if value is not None] == [5.0]


def test_a_pause_stays_empty_and_a_wide_screen_has_no_gaps() -> None:
    history = History()
    for tick in [*range(50), *range(150, 200)]:
        history.add(at(tick / 10.0, 1.0))
    values = history.curves(400)[0].values
    known = "".join(" " if value is None else "x" for value in values).split()
    assert [len(part) for part in known] == pytest.approx([100, 100], abs=12)


def test_a_replay_that_goes_back_begins_anew() -> None:
    history = History()
    history.add(at(100.0, 9.0))
    history.add(at(3.0, 4.0))
    assert [value for value in history.curves(10)[0].values if value is not None] == [4.0]


def test_what_is_no_number_is_not_known() -> None:
    history = History()
    history.add(at(math.nan, 1.0))
    history.add(at(1.0, math.inf, delay_ms=math.nan, overlap_mm3=math.nan))
    assert [curve.newest for curve in history.curves(5)] == [None, 0.31, None, 140.0]


def test_memory_is_bounded() -> None:
    history = History()
    for tick in range(10_000):
        history.add(at(tick / 1000.0, float(tick)))
    assert len(history._samples) <= 2000
