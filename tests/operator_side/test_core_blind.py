"""Without a field: triggers free, hands that move nothing, a signal, and no motion before the hands have rested."""

from typing import Any

import pytest

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import MotionCommand
from common.protocol.session import SessionState
from operator_side.core import STIFFNESS_EXPIRES_S
from operator_side.dualsense.reports.controller_state import Button
from operator_side.dualsense.reports.output_report import USUAL_LIGHT, WARNING_LIGHT, Rumble
from tests.operator_side.operator_bench import Bench

LATE_S = STIFFNESS_EXPIRES_S + 0.001
STICKS = {"left_stick": (1.0, 0.0), "right_stick": (0.0, 1.0)}


class Driving(Bench):
    """R2 pulled, both sticks and a gripper button held, towards a robot that is armed."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.feel(5)

    def command(self, *buttons: Button, r2: float = 1.0) -> MotionCommand:
        """What the hands do now."""
        self.notice(SessionState.ARMED)
        self.hands(Button.L1, Button.CROSS, *buttons, r2=r2, **STICKS)
        [command] = self.commands()
        self.write()
        return command

    def lose(self) -> None:
        """Without a word of what is ahead."""
        self.now_s += LATE_S
        assert not moves(self.command())

    @property
    def feels(self) -> str:
        return str(self.side.status(self.now_s)["feel"])


def moves(command: MotionCommand) -> bool:
    rest = (0.0, 0.0)
    return (command.l2, command.r2, command.lateral, command.turning, command.gripper) != (0.0, 0.0, rest, rest, 0.0)


def test_who_sees_moves() -> None:
    bench = Driving()
    assert moves(bench.command())
    bench.now_s += STIFFNESS_EXPIRES_S
    assert moves(bench.command())
    assert not bench.device.released
    assert bench.device.output.lightbar is None


def test_a_link_that_never_was_up_is_not_blind() -> None:
    bench = Bench()
    bench.now_s += 10.0
    bench.notice(SessionState.DISARMED)
    bench.hands(Button.L1, r2=1.0)
    assert moves(bench.commands()[0])
    bench.write()
    assert bench.device.write_count == 0


def test_blind_the_hands_move_nothing_and_are_told() -> None:
    bench = Driving()
    bench.now_s += LATE_S
    command = bench.command()
    assert not moves(command)
    assert command.run
    assert bench.device.released
    assert (bench.device.rumble.left, bench.device.rumble.right) == pytest.approx((0.7, 0.7), abs=0.01)
    assert bench.device.output.lightbar == WARNING_LIGHT
    assert bench.feels == "blind"


def test_the_buttons_that_stop_and_hand_over_stay_and_arming_does_not() -> None:
    bench = Driving()
    bench.lose()
    command = bench.command(Button.OPTIONS, Button.CREATE)
    assert (command.run, command.arm, command.hand_over) == (True, False, True)
    assert bench.command(Button.CIRCLE).emergency_stop


def test_motion_comes_back_after_the_field_and_a_rest_of_both_triggers_after_that() -> None:
    bench = Driving()
    bench.lose()
    assert not moves(bench.command(r2=0.0))  # a rest while blind does not count
    bench.command()
    bench.feel(5)
    assert bench.device.output.lightbar == USUAL_LIGHT
    assert bench.device.rumble == Rumble()
    assert bench.device.effects[1].zone_strengths == (5,) * 10
    command = bench.command(Button.OPTIONS)
    assert not moves(command)
    assert not command.arm
    assert bench.feels == "waiting for released triggers"
    assert bench.side.status(bench.now_s)["release_first"] is True
    assert moves(bench.command(r2=0.0))  # the sticks
    assert bench.command().r2 == 1.0
    assert bench.feels == "L2 free, R2 free to 0 %, then 5"
    assert bench.side.status(bench.now_s)["release_first"] is False
    assert bench.side.summary()["rendering"]["blind"] == 1
    # Its light has been changed, and is told again to whoever comes.
    bench.side.controller_found(bench.now_s)
    bench.write()
    bench.write()
    assert bench.device.output.lightbar == USUAL_LIGHT


def test_a_field_that_was_away_while_nobody_looked_is_back_all_the_same() -> None:
    bench = Driving()
    bench.now_s += LATE_S
    bench.feel(5)
    assert not moves(bench.command())
    assert moves(bench.command(r2=0.0))


def test_the_motors_fall_silent_and_the_light_stays() -> None:
    bench = Driving()
    bench.lose()
    writes, shaken = bench.device.write_count, 0
    for _ in range(2500):
        bench.now_s += 0.004
        bench.notice(SessionState.ARMED)
        bench.write()
        shaken += bench.device.rumble != Rumble()
    assert shaken * 0.004 == pytest.approx(6 * 0.12, abs=0.03)
    assert bench.device.write_count - writes == 11  # the last five pulses begin and end, the first one ends
    assert bench.device.rumble == Rumble()
    assert bench.device.output.lightbar == WARNING_LIGHT
    bench.device.close()
    assert bench.device.output.lightbar == USUAL_LIGHT


def test_a_controller_that_comes_while_blind_is_told_too() -> None:
    bench = Driving()
    bench.lose()
    bench.side.controller_lost(bench.now_s)
    bench.side.controller_found(bench.now_s)
    bench.write()
    assert bench.device.rumble == Rumble()
    bench.write()
    assert bench.device.rumble != Rumble()
    assert bench.device.output.lightbar == WARNING_LIGHT


def test_without_haptics_the_hands_rest_and_nothing_is_written() -> None:
    bench = Driving(haptics=False)
    bench.lose()
    bench.feel(5)
    assert not moves(bench.command())
    assert moves(bench.command(r2=0.0))
    assert bench.device.write_count == 0


@pytest.mark.parametrize("session", [SessionState.OBSERVING, SessionState.UNKNOWN, SessionState.ENDED])
def test_who_lost_the_lease_is_not_blind(session: SessionState) -> None:
    bench = Driving()
    bench.notice(session)
    bench.now_s += LATE_S
    bench.write()
    assert bench.device.released
    assert bench.device.output.lightbar is None
    assert bench.feels == "L2 free, R2 free"


def test_who_hears_while_blind_that_another_drives_is_told_no_more_and_rests_before_driving_again() -> None:
    bench = Driving()
    bench.lose()
    bench.notice(SessionState.OBSERVING)
    bench.write()
    assert bench.device.output.lightbar == USUAL_LIGHT
    assert not moves(bench.command())
    assert moves(bench.command(r2=0.0))


def test_a_robot_side_that_restarts_brings_the_field_back() -> None:
    bench = Driving()
    bench.lose()
    bench.robot = LinkEnd("robot", 9, "clock")
    bench.side.receive(encode(bench.robot.hello(bench.now_s)), bench.now_s)
    bench.write()
    assert bench.device.output.lightbar == WARNING_LIGHT
    bench.feel(5)
    assert bench.device.output.lightbar == USUAL_LIGHT
    assert not moves(bench.command())
