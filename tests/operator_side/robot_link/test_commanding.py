import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.periods import PERIODS_S, TURN_S
from common.silence import LONGEST_HELD_S
from operator_side.hands.intent import OperatorIntent
from operator_side.robot_link.commanding import STOPPING, HeldCommand
from robot_side.operators.safety import SafetySettings

REST = replace(STOPPING, emergency_stop=False, run=True)
travel, stick = st.floats(0.0, 1.0), st.floats(-1.0, 1.0)
intents = st.builds(
    lambda l2, r2, lateral, turning, run: replace(REST, l2=l2, r2=r2, lateral=lateral, turning=turning, run=run),
    *(travel, travel, st.tuples(stick, stick), st.tuples(stick, stick), st.booleans()),
)


def moved(intent: OperatorIntent) -> tuple[float, ...]:
    return (intent.l2, intent.r2, *intent.lateral, *intent.turning)


@given(st.lists(st.tuples(intents | st.just(REST), st.integers(1, 12), st.floats(-0.005, 0.005)), max_size=12))
@settings(max_examples=100)
def test_what_is_held_is_what_is_meant(steps: Any) -> None:
    held = HeldCommand()
    known, known_s, now_s = None, 0.0, 0.0
    for meant, turns, drift in steps:
        for turn in range(turns):
            now_s += TURN_S
            intent = replace(meant, r2=min(max(meant.r2 + turn * drift, 0.0), 1.0))
            if held.due(intent, 7, now_s) is not None:
                known, known_s = intent, now_s
            assert known is not None
            assert known.run == intent.run
            assert max(abs(a - b) for a, b in zip(moved(known), moved(intent), strict=True)) <= 0.01
            assert any(moved(intent)) or not any(moved(known))
            assert now_s - known_s < LONGEST_HELD_S - 1e-9


def test_a_hand_that_holds_still_is_heard_every_16_ms_and_at_full_rate_each_time() -> None:
    for full_rate, period_s in ((False, LONGEST_HELD_S), (True, TURN_S)):
        held = HeldCommand(full_rate=full_rate)
        sent = [turn * TURN_S for turn in range(250) if held.due(REST, 7, turn * TURN_S) is not None]
        assert [later - earlier for earlier, later in pairwise(sent)] == pytest.approx([period_s] * (len(sent) - 1))


@pytest.mark.parametrize("turn_s", PERIODS_S)
def test_whatever_the_period_of_turns_a_held_command_is_not_too_old_and_moves_are_at_most_250_a_second(
    turn_s: float,
) -> None:
    held, turns = HeldCommand(), [number * turn_s for number in range(500)]
    rests = [now_s for now_s in turns if held.due(REST, 7, now_s) is not None]
    assert {round(1e3 * (later - earlier)) for earlier, later in pairwise(rests)} == {
        max(round(1e3 * turn_s), round(1e3 * turn_s) * math.floor(LONGEST_HELD_S / turn_s + 1e-9))
    }
    moves = [
        now_s for number, now_s in enumerate(turns) if held.due(replace(REST, r2=0.37 * number % 1.0), 7, 60.0 + now_s)
    ]
    assert all(later - earlier >= TURN_S - 1e-9 for earlier, later in pairwise(moves)) or turn_s > TURN_S
    assert len(moves) >= min(1.0 / TURN_S, 1.0 / turn_s) * turns[-1]


def test_five_commands_of_resting_hands_may_come_late_before_the_robot_side_stops_the_arm() -> None:
    """Commands may be late because each connection in turn waits for a lost packet, and a turn may be 3 ms late."""
    held = HeldCommand()
    sent = [turn * TURN_S for turn in range(250) if held.due(REST, 7, turn * TURN_S) is not None]
    gap_s = SafetySettings().gap_s
    assert all(later - earlier < gap_s - 0.003 for earlier, later in zip(sent, sent[6:], strict=False))


def test_what_nobody_holds_any_more_is_said_again_everywhere() -> None:
    held = HeldCommand()
    assert held.due(REST, 7, 0.0) is not None
    assert held.due(REST, 7, 0.004) is None
    held.forget()
    said = held.due(REST, 7, 0.008)
    assert said is not None
    assert said.everywhere
