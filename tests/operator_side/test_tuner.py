"""Wishes to tune: asked for until the robot side has heard them, refused in words, and a stop besides the hands'."""

from typing import Any

import msgspec
import pytest

from common.protocol.codec import decode, encode
from common.protocol.messages import LeaseNotice, Tune
from common.protocol.session import SessionState
from operator_side.commanding import STOP_HELD_S
from operator_side.dualsense.reports.controller_state import Button
from tests.operator_side.operator_bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def permit(bench: Bench, **fields: Any) -> None:
    notice = LeaseNotice(
        bench.robot.stamp(bench.now_s), session=SessionState.DISARMED, why="", token=7, waiting=0, may_tune=True
    )
    bench.side.receive(encode(msgspec.structs.replace(notice, **fields)), bench.now_s)


def sent(bench: Bench, for_s: float = 0.0) -> list[Tune]:
    found = []
    for _ in range(1 + round(for_s / 0.004)):
        found += [message for message in map(decode, bench.side.motion(bench.now_s)) if isinstance(message, Tune)]
        bench.now_s += 0.004
    return found


def test_a_wish_is_repeated_until_it_was_heard(bench: Bench) -> None:
    permit(bench)
    bench.side.tune(0.9, None, bench.now_s)
    wishes = sent(bench, 0.42)
    assert len(wishes) == 5
    assert {(one.number, one.probability, one.link) for one in wishes} == {(1, 0.9, None)}
    permit(bench, tuned=1)
    assert sent(bench, 0.3) == []


def test_wishes_that_were_not_heard_yet_go_on_together(bench: Bench) -> None:
    permit(bench)
    bench.side.tune(0.9, None, bench.now_s)
    sent(bench)
    bench.side.tune(None, "delay 20ms", bench.now_s)
    assert [(one.number, one.probability, one.link) for one in sent(bench)] == [(2, 0.9, "delay 20ms")]
    permit(bench, tuned=2)
    bench.side.tune(None, "", bench.now_s)
    assert [(one.number, one.probability, one.link) for one in sent(bench)] == [(3, None, "")]
    assert [bench.side.tuner.take_link(), bench.side.tuner.take_link()] == ["", None]


@pytest.mark.parametrize(
    ("probability", "link", "may", "session", "says"),
    [
        (0.9, None, False, SessionState.DISARMED, "--permit-tuning"),
        (0.9, None, True, SessionState.OBSERVING, "only the owner"),
        (1.0, None, True, SessionState.DISARMED, "probability = 1.0"),
        (0.9, "delay 9s", True, SessionState.DISARMED, "delay up to"),
    ],
)
def test_what_is_no_use_is_refused_whole_in_one_line(
    bench: Bench, probability: float, link: str | None, may: bool, session: SessionState, says: str
) -> None:
    permit(bench, may_tune=may, session=session)
    bench.side.tune(probability, link, bench.now_s)
    assert sent(bench, 0.2) == []
    assert says in bench.side.tuner.why
    assert (bench.side.tuner.take_link(), bench.side.summary()["tuning"]["refused"]) == (None, 1)


def stops(bench: Bench) -> list[bool]:
    return [command.emergency_stop for command in bench.commands()]


def test_a_stop_goes_out_without_any_controller_until_it_was_heard(bench: Bench) -> None:
    bench.feel(0)
    assert bench.commands() == []
    bench.side.stop_button.press(bench.now_s)
    for _ in range(200):
        bench.now_s += 0.004
        bench.notice(SessionState.ARMED)
        bench.feel(0)
        assert stops(bench) == [True]
    bench.feel(0, "stopped")
    assert bench.commands() == []
    assert bench.side.summary()["stops_pressed_elsewhere"] == 1


def test_a_stop_is_held_for_a_while_at_least_and_moves_nothing(bench: Bench) -> None:
    bench.feel(0, "stopped")
    bench.side.stop_button.press(bench.now_s)
    began_s = bench.now_s
    while bench.now_s - began_s < STOP_HELD_S:
        bench.hands(Button.L1, Button.OPTIONS, r2=1.0)
        [command] = bench.commands()
        assert (command.emergency_stop, command.run, command.arm, command.r2) == (True, False, False, 0.0)
        bench.now_s += 0.004
        bench.feel(0, "stopped")
    bench.hands(Button.L1, r2=1.0)
    assert stops(bench) == [False]


def test_an_observer_stops_nothing_and_not_later_either(bench: Bench) -> None:
    bench.notice(SessionState.OBSERVING)
    bench.side.stop_button.press(bench.now_s)
    assert bench.commands() == []
    bench.notice(SessionState.OBSERVING)
    bench.notice(SessionState.DISARMED)
    bench.hands()
    assert stops(bench) == [False]
