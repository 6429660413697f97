from typing import Any

import pytest

from common.protocol.link_end import Arrival
from common.protocol.messages import Header, MotionCommand
from common.protocol.session import Session, SessionEvent
from robot_side.operators.safety import Safety, SafetySettings

FRESH = Arrival(fresh=True, queueing_age_s=0.0, one_way_s=0.01, loop_age_s=0.02)
STEP_S = 0.004


class Stream:
    """An operator's commands, one each 4 ms."""

    def __init__(self, settings: SafetySettings | None = None) -> None:
        self.safety = Safety(settings or SafetySettings())
        self.session = Session()
        self.session.handle(SessionEvent.ASKED_WHILE_FREE)
        self.safety.begin(self.session)
        self.now_s = 10.0
        self._sequence = 0

    def send(self, duration_s: float, arrival: Arrival = FRESH, **fields: Any) -> None:
        for _ in range(round(duration_s / STEP_S)):
            self.now_s += STEP_S
            self._sequence += 1
            header = Header(epoch=1, sequence=self._sequence, sent_s=self.now_s)
            content: dict[str, Any] = {"l2": 0.0, "r2": 0.0, "run": True} | fields
            self.safety.receive(MotionCommand(header, **content), arrival, self.now_s)

    def arm(self) -> None:
        self.send(1.1)
        self.send(0.1, arm=True)
        assert self.state == "armed"

    @property
    def state(self) -> str:
        return self.safety.permission(self.now_s).state


def test_arming_takes_a_healthy_second_with_released_triggers() -> None:
    stream = Stream()
    stream.send(0.9)
    stream.send(0.05, arm=True)
    assert stream.state == "disarmed"
    stream.send(0.1)
    stream.send(0.05, arm=True)
    assert stream.state == "armed"


def test_a_pulled_trigger_starts_the_healthy_second_anew() -> None:
    stream = Stream()
    stream.send(0.9)
    stream.send(0.1, r2=0.5)
    stream.send(0.5)
    stream.send(0.1, arm=True)
    assert stream.state == "disarmed"


def test_an_arming_button_that_is_held_all_along_does_not_arm() -> None:
    stream = Stream()
    stream.send(3.0, arm=True)
    assert stream.state == "disarmed"


def test_motion_needs_arming_and_the_run_button() -> None:
    stream = Stream()
    stream.send(0.5, r2=1.0)
    assert stream.safety.permission(stream.now_s).command is None
    stream.arm()
    stream.send(0.1, r2=1.0)
    command = stream.safety.permission(stream.now_s).command
    assert command is not None
    assert command.r2 == 1.0
    stream.send(0.1, r2=1.0, run=False)
    assert stream.safety.permission(stream.now_s).command is None
    assert stream.state == "armed"


def test_a_gap_within_the_limit_holds_the_last_command() -> None:
    stream = Stream()
    stream.arm()
    stream.send(0.1, r2=1.0)
    permission = stream.safety.permission(stream.now_s + 0.099)
    assert permission.command is not None
    assert permission.valid_until_s == pytest.approx(stream.now_s + 0.1)


def test_a_longer_gap_stops_and_needs_arming_again() -> None:
    stream = Stream()
    stream.arm()
    stream.send(0.1, r2=1.0)
    stream.now_s += 0.101
    assert stream.safety.permission(stream.now_s).command is None
    stream.send(0.5, r2=1.0)
    assert stream.safety.permission(stream.now_s).command is None
    assert stream.state == "disarmed"
    [(_, reason)] = stream.safety.stops
    assert "no command for" in reason


def test_the_gap_counts_even_when_nobody_ticks_in_between() -> None:
    stream = Stream()
    stream.arm()
    stream.now_s += 5.0
    stream.send(STEP_S, r2=1.0)
    assert stream.safety.permission(stream.now_s).command is None
    assert stream.state == "disarmed"


def test_commands_that_queued_are_discarded_and_a_steady_delay_is_not() -> None:
    stream = Stream()
    stream.arm()
    steady = Arrival(fresh=True, queueing_age_s=0.0, one_way_s=0.5, loop_age_s=1.0)
    stream.send(0.1, steady, r2=0.5)
    assert stream.safety.permission(stream.now_s).command is not None
    queued = Arrival(fresh=True, queueing_age_s=0.19, one_way_s=0.2, loop_age_s=0.3)
    stream.send(0.05, queued, r2=1.0)
    command = stream.safety.permission(stream.now_s).command
    assert command is not None
    assert command.r2 == 0.5
    assert stream.safety.discarded_by_age > 0


def test_late_commands_never_move() -> None:
    stream = Stream()
    stream.arm()
    stream.send(0.1, Arrival(fresh=False, queueing_age_s=0.0, one_way_s=0.1, loop_age_s=0.1), r2=1.0)
    command = stream.safety.permission(stream.now_s).command
    assert command is None or command.r2 == 0.0


def test_a_loop_that_grew_too_old_disarms() -> None:
    stream = Stream()
    stream.arm()
    stream.send(STEP_S, Arrival(fresh=True, queueing_age_s=0.0, one_way_s=1.0, loop_age_s=2.1))
    assert stream.state == "disarmed"


def test_an_emergency_stop_counts_however_late_it_comes() -> None:
    stream = Stream()
    stream.arm()
    late = Arrival(fresh=False, queueing_age_s=3.0, one_way_s=3.0, loop_age_s=None)
    stream.send(STEP_S, late, emergency_stop=True)
    assert stream.state == "stopped"
    stream.send(0.5, r2=1.0)
    assert stream.safety.permission(stream.now_s).command is None
    stream.arm()


def test_a_new_epoch_disarms() -> None:
    stream = Stream()
    stream.arm()
    stream.send(0.1, r2=1.0)
    stream.safety.end(SessionEvent.NEW_EPOCH, stream.now_s)
    assert stream.safety.permission(stream.now_s).command is None
    assert stream.state == "disarmed"


@pytest.mark.parametrize("name", ["gap_s", "age_s", "max_delay_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_zero_never_means_no_limit(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        SafetySettings(**{name: value})


@pytest.mark.parametrize("value", [0.0, 0.1, 60.0, float("nan")])
def test_a_lease_outlasts_a_gap(value: float) -> None:
    with pytest.raises(ValueError, match="lease_s"):
        SafetySettings(lease_s=value)


def test_stopping_what_is_not_armed_is_no_stop() -> None:
    stream = Stream()
    stream.send(0.1)
    stream.now_s += 1.0
    assert stream.state == "disarmed"
    assert not stream.safety.stops


def test_a_loop_that_falls_silent_grows_old_while_commands_keep_coming() -> None:
    stream = Stream()
    stream.arm()
    no_echo = Arrival(fresh=True, queueing_age_s=0.0, one_way_s=0.01, loop_age_s=None)
    stream.send(1.9, no_echo, r2=0.5)
    assert stream.state == "armed"
    stream.send(0.2, no_echo, r2=0.5)
    assert stream.state == "disarmed"


def test_a_loop_age_that_is_not_known_keeps_from_arming() -> None:
    stream = Stream()
    unknown = Arrival(fresh=True, queueing_age_s=0.0, one_way_s=0.01, loop_age_s=None)
    stream.send(1.1, unknown)
    stream.send(0.1, unknown, arm=True)
    assert stream.state == "disarmed"


def test_an_emergency_stop_outlasts_its_operator() -> None:
    stream = Stream()
    stream.arm()
    stream.send(STEP_S, emergency_stop=True)
    stream.safety.end(SessionEvent.SILENT, stream.now_s)
    assert stream.state == "stopped"
    stream.session = Session()
    stream.session.handle(SessionEvent.ASKED_WHILE_FREE)
    stream.safety.begin(stream.session)
    assert stream.state == "stopped"
    assert [why for _, why in stream.safety.stops] == ["emergency stop"]
    stream.arm()
