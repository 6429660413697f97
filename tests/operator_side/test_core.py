from collections.abc import Callable

import pytest

from common.protocol.codec import PROTOCOL_VERSION, decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Hello, MotionCommand, MotionState, Telemetry
from common.protocol.session import SessionState
from operator_side.core import INTENT_EXPIRES_S, STIFFNESS_EXPIRES_S, OperatorSide
from operator_side.dualsense.effects.official import Off
from operator_side.dualsense.reports.controller_state import Button
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from operator_side.standing import NOTICE_EXPIRES_S
from tests.operator_side.operator_bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_stiffness_reaches_the_trigger_it_is_meant_for(bench: Bench) -> None:
    bench.feel(6)
    l2, r2 = bench.device.effects
    assert l2 == Off()
    assert r2.zone_strengths == (6,) * 10


def test_writes_are_bounded_the_newest_wins_and_a_release_does_not_wait(bench: Bench) -> None:
    for step in range(1000):
        bench.now_s += 0.001
        bench.feel(7, "armed" if step % 2 else "disarmed")
    assert 50 < bench.device.write_count <= 100
    bench.feel(8)
    bench.now_s += 0.1
    bench.write()
    assert bench.device.effects[1].zone_strengths == (8,) * 10
    for step in range(40):
        bench.feel(1 + step % 8)
    assert not bench.device.released
    bench.feel(0, "disarmed")
    assert bench.device.released


def test_another_calibration_changes_what_is_read_and_what_is_felt(bench: Bench) -> None:
    bench.side.calibrate(TravelCalibration(r2=TriggerTravel(0.45, 0.65)))
    bench.device.set_finger_force(0.0, 0.5 + 4.0 * 0.75 * 0.55)
    bench.device.read(bench.now_s)
    bench.now_s += 1.0
    bench.notice(SessionState.DISARMED)
    bench.read()
    assert bench.commands()[0].r2 == pytest.approx(0.5, abs=0.05)
    bench.feel(6)
    # Before the fourth zone nothing is commanded.
    assert bench.device.effects[1].zone_strengths == (0,) * 3 + (6,) * 7


def test_with_swapped_sides_the_left_trigger_advances_and_feels_it() -> None:
    bench = Bench(swap_sides=True)
    bench.device.set_finger_force(10.0, 0.0)
    bench.device.read(bench.now_s)
    bench.now_s += 1.0
    bench.notice(SessionState.DISARMED)
    bench.read()
    [command] = bench.commands()
    assert (command.l2, command.r2) == (0.0, 1.0)
    bench.feel(6)
    l2, r2 = bench.device.effects
    assert l2.zone_strengths == (6,) * 10
    assert r2 == Off()
    status = bench.side.status(bench.now_s)
    assert (status["L2"], status["R2"], status["feel"]) == (0.75, 0.0, "L2 free to 0 %, then 6, R2 free")


def test_the_run_and_people_are_told_what_is_felt(bench: Bench) -> None:
    bench.feel(6)
    status = bench.side.status(bench.now_s)
    assert (status["L2"], status["R2"], status["feel"]) == (0.0, 0.75, "L2 free, R2 free to 0 %, then 6")
    summary = bench.side.summary()
    assert summary["zones"] == {"l2": {"first_stiff": None, "max": 0}, "r2": {"first_stiff": 0, "max": 6}}
    assert summary["rendering"] == {
        "l2": {"beyond_horizon": 0},
        "r2": {"beyond_horizon": 0},
        "writes": 1,
        "without_history": 1,
        "blind": 0,
    }


def test_only_changes_are_written(bench: Bench) -> None:
    bench.feel(6)
    bench.now_s += 0.001
    bench.feel(6)
    assert bench.device.write_count == 1


def test_triggers_are_released_when_stiffness_stops_coming(bench: Bench) -> None:
    bench.feel(8)
    bench.now_s += STIFFNESS_EXPIRES_S
    bench.write()
    assert not bench.device.released
    bench.now_s += 0.001
    bench.write()
    assert bench.device.released


@pytest.mark.parametrize("state", ["disarmed", "stopped"])
def test_nothing_is_felt_while_the_arm_cannot_move(bench: Bench, state: MotionState) -> None:
    bench.feel(8)
    bench.feel(8, state)
    assert bench.device.released


def test_without_haptics_nothing_is_ever_written() -> None:
    bench = Bench(haptics=False)
    bench.feel(8, rumble=1.0)
    assert bench.device.write_count == 0


def test_rumble_comes_and_goes(bench: Bench) -> None:
    bench.feel(0, rumble=1.0)
    assert bench.device.rumble.left == 1.0
    bench.feel(0)
    assert bench.device.rumble.left == 0.0


def test_an_older_stiffness_is_never_felt(bench: Bench) -> None:
    older = bench.stiffness(8)
    bench.feel(2)
    felt = bench.device.effects
    bench.side.receive(older, bench.now_s)
    bench.write()
    assert bench.device.effects == felt
    assert bench.side.link.stale == 1


def test_hands_become_a_motion_command(bench: Bench) -> None:
    bench.device.set_finger_force(0.0, 10.0)
    bench.device.set_buttons(frozenset({Button.L1, Button.CROSS}))
    bench.device.set_sticks(left=(1.0, 0.0))
    bench.device.read(bench.now_s)
    bench.now_s += 1.0
    bench.notice(SessionState.DISARMED)
    bench.read()
    [command] = bench.commands()
    assert command.r2 == 1.0
    assert command.l2 == 0.0
    assert command.run
    assert command.gripper == 1.0
    assert command.lateral[0] == pytest.approx(1.0, abs=0.02)


def test_a_controller_that_went_silent_sends_nothing(bench: Bench) -> None:
    assert bench.commands() == []
    bench.read()
    assert len(bench.commands()) == 1
    bench.now_s += INTENT_EXPIRES_S + 0.001
    assert bench.commands() == []


def test_hello_is_repeated_until_the_robot_answers(bench: Bench) -> None:
    def hellos() -> int:
        return sum(isinstance(decode(payload), Hello) for payload in bench.side.motion(bench.now_s))

    counted = 0
    for _ in range(250):
        bench.now_s += 0.004
        counted += hellos()
    assert 4 <= counted <= 6
    bench.feel(0)
    assert hellos() == 0
    bench.now_s += 2.0
    assert hellos() == 1


def test_what_the_hands_did_last_counts_no_more_without_a_controller(bench: Bench) -> None:
    bench.read()
    assert len(bench.commands()) == 1
    bench.side.controller_lost(bench.now_s)
    assert bench.commands() == []


def test_a_controller_that_is_back_commands_nothing_before_the_arm_has_stopped(bench: Bench) -> None:
    bench.feel(2)
    bench.side.controller_lost(bench.now_s)
    for state, commands in (("armed", 0), ("armed", 0), ("disarmed", 1), ("armed", 1)):
        bench.now_s += 0.01
        bench.side.controller_found(bench.now_s)
        bench.feel(2, state)  # type: ignore[arg-type]
        bench.notice(SessionState.DISARMED)
        bench.read()
        assert len(bench.commands()) == commands, state


def test_its_emergency_stop_counts_at_once(bench: Bench) -> None:
    bench.feel(2)
    bench.side.controller_lost(bench.now_s)
    bench.side.controller_found(bench.now_s)
    bench.device.set_buttons(frozenset({Button.CIRCLE}))
    bench.now_s += 0.01
    bench.feel(2)
    bench.read()
    [command] = bench.commands()
    assert command.emergency_stop


def test_a_controller_that_is_found_is_released_before_it_is_told_anew(bench: Bench) -> None:
    bench.feel(6)
    stiff = bench.device.effects
    bench.side.controller_lost(bench.now_s)
    bench.side.controller_found(bench.now_s)
    bench.write()
    assert bench.device.released
    bench.write()
    assert bench.device.effects == stiff
    assert bench.device.write_count == 3


def test_without_haptics_a_controller_that_is_found_is_left_alone() -> None:
    bench = Bench(haptics=False)
    bench.side.controller_found(bench.now_s)
    bench.feel(8)
    assert bench.device.write_count == 0


def telemetry(robot: LinkEnd, now_s: float, speed: float) -> bytes:
    return encode(
        Telemetry(
            robot.stamp(now_s),
            state="armed",
            tool_position_m=(0.0, 0.0, 0.0),
            tool_speed_m_s=speed,
            target=None,
            target_in_tool_m=None,
            up_in_tool=(0.0, -1.0, 0.0),
            gripper_opening_m=0.0,
            holding=False,
            enlargement_m=0.0,
            l2=0.0,
            r2=0.0,
        )
    )


def test_the_screen_shows_the_newest_view_of_the_present_epoch(bench: Bench) -> None:
    first, second = (telemetry(bench.robot, bench.now_s, speed) for speed in (0.1, 0.2))
    bench.side.receive_view(second, bench.now_s)
    bench.side.receive_view(first, bench.now_s)
    assert bench.side.screen is not None
    assert bench.side.screen.tool_speed_m_s == 0.2
    stranger = LinkEnd("robot", 9, "clock")
    bench.side.receive_view(telemetry(stranger, bench.now_s, 0.3), bench.now_s)
    assert bench.side.screen.tool_speed_m_s == 0.2


@pytest.mark.parametrize(
    "receive", [OperatorSide.receive, OperatorSide.receive_view, OperatorSide.read_report], ids=lambda f: f.__name__
)
def test_garbage_is_counted_and_changes_nothing(
    bench: Bench, receive: Callable[[OperatorSide, bytes, float], None]
) -> None:
    bench.feel(2)
    receive(bench.side, b"\x93garbage", bench.now_s)
    assert bench.side.rejected == 1
    assert bench.side.output_report(bench.now_s) is None


def test_a_message_of_the_wrong_kind_is_rejected(bench: Bench) -> None:
    command = MotionCommand(bench.robot.stamp(1.0), l2=0.0, r2=0.0)
    bench.side.receive(encode(command), bench.now_s)
    bench.side.receive_view(bench.stiffness(8), bench.now_s)
    assert bench.side.rejected == 2


def test_a_restarted_robot_is_followed(bench: Bench) -> None:
    bench.feel(2)
    bench.robot = LinkEnd("robot", 7, "clock")
    bench.side.receive(encode(bench.robot.hello(bench.now_s)), bench.now_s)
    bench.feel(8)
    assert bench.device.effects[1].zone_strengths == (8,) * 10


def test_an_observer_sends_nothing_but_hellos(bench: Bench) -> None:
    bench.notice(SessionState.OBSERVING)
    sent = []
    for _ in range(250):
        bench.now_s += 0.004
        bench.read()
        bench.notice(SessionState.OBSERVING)
        bench.feel(2)
        sent += [decode(payload) for payload in bench.side.motion(bench.now_s)]
    assert all(isinstance(message, Hello) for message in sent)
    assert len(sent) == pytest.approx(5, abs=1)
    assert bench.side.motion_sent == 0


def test_commands_carry_the_token_of_the_lease(bench: Bench) -> None:
    bench.read()
    assert [command.token for command in bench.commands()] == [7]
    bench.notice(SessionState.DISARMED, token=9)
    assert [command.token for command in bench.commands()] == [9]


def test_without_notices_the_lease_is_not_known_any_more(bench: Bench) -> None:
    bench.now_s += NOTICE_EXPIRES_S + 0.001
    bench.read()
    assert bench.commands() == []
    assert bench.side.lease is None


def test_the_create_button_hands_over(bench: Bench) -> None:
    bench.device.set_buttons(frozenset({Button.CREATE}))
    bench.read()
    [command] = bench.commands()
    assert command.hand_over


def test_an_owner_without_a_controller_still_says_hello(bench: Bench) -> None:
    hellos = 0
    for _ in range(250):
        bench.now_s += 0.004
        bench.notice(SessionState.DISARMED)
        bench.feel(0)
        hellos += sum(isinstance(decode(payload), Hello) for payload in bench.side.motion(bench.now_s))
    assert hellos == pytest.approx(5, abs=1)


@pytest.mark.parametrize(
    ("session", "shown"),
    [
        (SessionState.ARMED, "up"),
        (SessionState.OBSERVING, "observing (1 of 2 waiting)"),
        (SessionState.UNKNOWN, "refused: 8 others observe already"),
        (SessionState.ENDED, "refused: 8 others observe already"),
    ],
)
def test_the_status_shows_where_we_stand(bench: Bench, session: SessionState, shown: str) -> None:
    bench.feel(0)
    bench.notice(session, "8 others observe already")
    status = bench.side.status(bench.now_s)
    assert (status["link"], status["state"]) == (shown, "armed")


def test_a_link_that_was_up_is_lost_and_not_awaited(bench: Bench) -> None:
    assert bench.side.status(bench.now_s)["link"] == "waiting for the robot side"
    bench.feel(2)
    assert bench.side.status(bench.now_s)["link"] == "up"
    bench.now_s += STIFFNESS_EXPIRES_S + 0.1
    assert bench.side.status(bench.now_s)["link"] == "lost: nothing heard from the robot"


def test_why_it_stopped_is_shown_once_it_has_been_armed(bench: Bench) -> None:
    bench.notice(SessionState.DISARMED, "first come, and always disarmed")
    bench.feel(0, "disarmed")
    assert bench.side.status(bench.now_s)["stopped_because"] is None
    bench.feel(0)
    assert bench.side.status(bench.now_s)["stopped_because"] is None
    bench.notice(SessionState.STOPPED, "emergency stop")
    bench.feel(0, "stopped")
    assert bench.side.status(bench.now_s)["stopped_because"] == "emergency stop"


@pytest.mark.parametrize("swapped", [False, True])
def test_the_status_says_how_far_the_controllers_own_triggers_are_pulled(swapped: bool) -> None:
    bench = Bench(swap_sides=swapped)
    status = bench.side.status(bench.now_s)
    assert (status["L2_pulled"], status["R2_pulled"]) == (None, None)
    bench.device.set_finger_force(10.0, 0.0)
    bench.device.read(bench.now_s)
    bench.now_s += 1.0
    bench.read()
    status = bench.side.status(bench.now_s)
    assert (status["L2_pulled"], status["R2_pulled"]) == (1.0, 0.0)
    assert bench.side.status(bench.now_s + INTENT_EXPIRES_S + 0.1)["L2_pulled"] is None


def test_every_standing_is_in_the_summary(bench: Bench) -> None:
    for session in (SessionState.READY, SessionState.ARMED, SessionState.OBSERVING, SessionState.DISARMED):
        bench.notice(session)
    assert bench.side.summary()["lease_states"] == ["owner", "observing", "owner"]


def test_a_robot_side_of_another_version_is_told_apart(bench: Bench) -> None:
    payload = bytes([0x92, PROTOCOL_VERSION + 1]) + bench.stiffness(4)[2:]
    bench.side.receive(payload, bench.now_s)
    shown = bench.side.status(bench.now_s)["link"]
    assert shown == f"refused: protocol version {PROTOCOL_VERSION + 1}; valid: {PROTOCOL_VERSION}"
    assert bench.side.rejected == 1
    bench.feel(2)
    assert bench.side.status(bench.now_s)["link"] == "up"


def test_a_lease_of_a_robot_side_that_restarted_does_not_count(bench: Bench) -> None:
    bench.robot = LinkEnd("robot", 7, "clock")
    bench.side.receive(encode(bench.robot.hello(bench.now_s)), bench.now_s)
    bench.read()
    assert bench.commands() == []
