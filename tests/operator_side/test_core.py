"""Core of the operator side, by examples: writes, messages, views, counts; test_core_states.py tests the states."""

from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from common.protocol.codec import PROTOCOL_VERSION, decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import AnyMessage, Header, Hello, LeaseNotice, MotionCommand, Tune
from common.protocol.session import SessionState
from common.status.codes import LinkState, Sight
from operator_side.controller.feel import USUAL_LIGHT, WARNING_LIGHT
from operator_side.controller.state import Button
from operator_side.core import OperatorSide
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from tests.helpers.messages import field, onsets, telemetry, uniform_update
from tests.operator_side.operator_bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def sent(bench: Bench, kind: type[AnyMessage], for_s: float = 0.0) -> list[Any]:
    """Return the messages of this kind that are sent during `for_s`, while the robot side sends nothing."""
    found = []
    for _ in range(1 + round(for_s / 0.004)):
        found += [message for message in map(decode, bench.payloads()) if isinstance(message, kind)]
        bench.now_s += 0.004
    return found


def test_another_calibration_changes_what_is_read_and_what_is_felt(bench: Bench) -> None:
    bench.side.calibrate(TravelCalibration(r2=TriggerTravel(0.45, 0.65)))
    bench.hands(r2=0.55)
    assert bench.commands()[0].r2 == pytest.approx(0.5, abs=0.02)
    bench.feel(6)
    # Zones before the fourth command no motion.
    assert bench.device.strengths[1] == (0,) * 3 + (6,) * 7


@pytest.mark.parametrize("swapped", [False, True])
def test_status_and_summary_speak_of_the_controllers_own_triggers(swapped: bool) -> None:
    bench, order = Bench(swap_sides=swapped), -1 if swapped else 1
    assert (status := bench.side.status(bench.now_s)).l2_pulled is status.r2_pulled is None
    bench.hands(**{"l2" if swapped else "r2": 1.0})
    [command] = bench.commands()
    assert (command.l2, command.r2) == (0.0, 1.0)
    bench.feel(6)
    status = bench.side.status(bench.now_s)
    assert [status.l2_course_stiffness, status.r2_course_stiffness][::order] == [0.0, 0.75]
    assert [status.l2_pulled, status.r2_pulled][::order] == [0.0, 1.0]
    assert [status.l2_free, status.r2_free][::order] == [1.0, 0.0]
    assert status.feel is Sight.SEEING
    assert bench.side.status(bench.now_s + 0.11).l2_pulled is None
    summary = bench.side.summary()
    zones = [{"first_stiff": None, "max": 0}, {"first_stiff": 0, "max": 6}][::order]
    assert [summary["zones"][name] for name in ("l2", "r2")] == zones
    none_beyond = {"beyond_horizon": 0}
    counts = {"writes": 1, "without_history": 1, "blind": 0}
    assert summary["rendering"] == {"l2": none_beyond, "r2": none_beyond} | counts


def test_of_five_turns_one_needs_a_command_and_one_a_write() -> None:
    bench = Bench()
    for _ in range(5):
        bench.hands(r2=0.5)
        bench.commands()
        bench.feel(6)
        bench.now_s += 0.001
    assert bench.side.summary()["skipped"] == {
        name: {"done": 1, "of": 5, "skipped": 0.8} for name in ("motion_messages", "writes")
    }
    assert Bench(haptics=False).side.summary()["skipped"] == {}


def test_without_haptics_nothing_is_ever_written_and_the_hands_rest_all_the_same() -> None:
    bench = Bench(haptics=False)
    bench.side.controller_found(bench.now_s)
    bench.feel(8, rumble=1.0)
    bench.now_s += 0.201
    bench.notice(SessionState.ARMED)
    bench.hands(Button.L1, r2=1.0)
    assert [command.r2 for command in bench.commands()] == [0.0]
    bench.write()
    assert bench.side.haptics.writes == 0


def test_a_controller_that_comes_while_blind_is_released_then_told(bench: Bench) -> None:
    bench.feel(5)
    assert bench.device.commanded.light is None
    bench.now_s += 0.201
    bench.notice(SessionState.ARMED)
    bench.write()
    for light in (None, WARNING_LIGHT):
        bench.side.controller_found(bench.now_s) if light is None else None
        bench.write()
    assert bench.device.commanded.light == WARNING_LIGHT
    assert bench.side.status(bench.now_s).feel is Sight.BLIND
    bench.feel(5)
    assert bench.device.commanded.light == USUAL_LIGHT
    assert bench.device.strengths[1] == (5,) * 10
    assert bench.side.status(bench.now_s).feel is Sight.WAITING
    assert bench.side.summary()["rendering"]["blind"] == 1


def test_hello_is_repeated_until_the_robot_answers_and_while_nothing_else_is_sent(bench: Bench) -> None:
    assert len(sent(bench, Hello, 1.0)) == pytest.approx(5, abs=1)
    for session in (SessionState.DISARMED, SessionState.OBSERVING):  # Without a controller, and as an observer.
        hellos = 0
        for _ in range(250):
            bench.notice(session)
            bench.feel(0)
            hellos += len(sent(bench, Hello))
        assert hellos == pytest.approx(5, abs=1)
    bench.notice(SessionState.DISARMED)
    bench.feel(0)
    bench.hands()
    assert [type(decode(payload)) for payload in bench.payloads()] == [MotionCommand]


def epoch_of(bench: Bench) -> int:
    epoch: int = sent(bench, Hello)[0].header.epoch
    return epoch


def test_an_ended_epoch_is_followed_by_one_epoch_despite_messages_under_way(bench: Bench) -> None:
    epochs = [epoch_of(bench)]
    for after_s in (0.3, 0.3, 2.0, 2.0, 1.0):
        bench.now_s += after_s
        bench.notice(SessionState.ENDED)
        epochs.append(epoch_of(bench))
    first, *rest, last = epochs
    assert len({first, *rest, last}) == 3
    assert set(rest) == {rest[0]}


def test_the_screen_shows_the_newest_view_of_the_present_epoch(bench: Bench) -> None:
    ends = (bench.robot, bench.robot, LinkEnd("robot", 9, "clock"))
    first, second, stranger = (
        encode(telemetry(robot.stamp(bench.now_s), tool_speed_m_s=speed))
        for robot, speed in zip(ends, (0.125, 0.25, 0.3), strict=True)
    )
    for payload in (second, first, stranger):
        bench.side.receive_view(payload, bench.now_s)
        assert bench.side.screen is not None
        assert bench.side.screen.tool_speed_m_s == 0.25


@pytest.mark.parametrize("receive", [OperatorSide.receive, OperatorSide.receive_view])
def test_garbage_and_messages_of_the_wrong_kind_are_counted_and_change_nothing(
    bench: Bench, receive: Callable[[OperatorSide, bytes, float], None]
) -> None:
    bench.feel(2)
    receive(bench.side, b"\x93garbage", bench.now_s)
    receive(bench.side, encode(MotionCommand(bench.robot.stamp(1.0), l2=0.0, r2=0.0)), bench.now_s)
    assert bench.side.rejected == 2
    assert bench.side.feel_now(bench.now_s) is None


def test_a_robot_side_of_another_version_is_told_apart(bench: Bench) -> None:
    payload = bytes([0x92, PROTOCOL_VERSION + 1]) + bench.stiffness(4)[2:]
    bench.side.receive(payload, bench.now_s)
    shown = bench.side.status(bench.now_s)
    why = f"protocol version {PROTOCOL_VERSION + 1}; valid: {PROTOCOL_VERSION}"
    assert (shown.link, shown.link_reason) == (LinkState.REFUSED, why)
    assert bench.side.rejected == 1
    bench.feel(2)
    assert bench.side.status(bench.now_s).link is LinkState.UP


def test_the_status_shows_where_we_stand_and_the_summary_each_standing(bench: Bench) -> None:
    assert bench.side.status(bench.now_s).link is LinkState.WAITING
    bench.feel(0)
    for session, shown in (
        (SessionState.ARMED, (LinkState.UP, None)),
        (SessionState.READY, (LinkState.UP, None)),
        (SessionState.OBSERVING, (LinkState.OBSERVING, None)),
        (SessionState.UNKNOWN, (LinkState.REFUSED, "8 others observe already")),
        (SessionState.DISARMED, (LinkState.UP, None)),
    ):
        bench.notice(session, "8 others observe already")
        status = bench.side.status(bench.now_s)
        assert (status.link, status.link_reason) == shown
        assert (status.state, status.owner, status.place, status.waiting) == ("armed", session, 1, 2)
    assert bench.side.summary()["lease_states"] == ["owner", "observing", str(SessionState.UNKNOWN), "owner"]
    bench.now_s += 0.201
    assert bench.side.status(bench.now_s).link is LinkState.LOST


def permit(bench: Bench, **fields: Any) -> None:
    notice = LeaseNotice(
        bench.robot.stamp(bench.now_s), session=SessionState.DISARMED, why="", token=7, waiting=0, may_tune=True
    )
    bench.side.receive(encode(msgspec.structs.replace(notice, **fields)), bench.now_s)


def wishes(bench: Bench, for_s: float = 0.0) -> list[tuple[int, float | None, str | None]]:
    return [(wish.number, wish.probability, wish.link) for wish in sent(bench, Tune, for_s)]


def test_a_wish_is_repeated_until_it_was_heard_and_goes_on_with_the_next_one(bench: Bench) -> None:
    permit(bench)
    bench.side.tune(0.9, None, bench.now_s)
    assert wishes(bench, 0.42) == [(1, 0.9, None)] * 5
    bench.side.tune(None, "delay 20ms", bench.now_s)
    assert wishes(bench) == [(2, 0.9, "delay 20ms")]
    permit(bench, tuned=2)
    assert wishes(bench, 0.3) == []
    bench.side.tune(None, "", bench.now_s)
    assert wishes(bench) == [(3, None, "")]
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
    assert wishes(bench, 0.2) == []
    assert says in bench.side.tuner.why
    assert (bench.side.tuner.take_link(), bench.side.summary()["tuning"]["refused"]) == (None, 1)


def test_buttons_and_rest_go_everywhere_and_what_the_fingers_do_in_turn(bench: Bench) -> None:
    bench.notice(SessionState.DISARMED)
    stop = (Button.CIRCLE,)
    for buttons, r2, everywhere in (
        *(((), 0.0, True), ((), 0.5, False), ((), 0.0, True), ((Button.L1,), 0.0, True), ((Button.L1,), 1.0, False)),
        *(((), 1.0, True), (stop, 1.0, True), (stop, 0.5, True), ((), 0.5, True), ((Button.CROSS,), 0.5, True)),
    ):
        bench.now_s += 0.004
        bench.hands(*buttons, r2=r2)
        sent = [one for one in bench.side.motion(bench.now_s) if isinstance(decode(one.payload), MotionCommand)]
        assert [one.everywhere for one in sent] == [everywhere], (buttons, r2)
    bench.notice(SessionState.DISARMED, token=2)
    assert next(one.everywhere for one in bench.side.motion(bench.now_s + 0.004))


def test_the_way_home_is_asked_for_at_the_chosen_speed() -> None:
    bench = Bench(speed_scale=0.5)
    bench.notice(SessionState.ARMED)
    for buttons in ((), (Button.MUTE,), ()):
        bench.hands(Button.L1, *buttons)
        assert {command.home for command in sent(bench, MotionCommand, 0.02)} == {0.5 if buttons else 0.0}


@pytest.mark.parametrize(("session", "unknown"), [(SessionState.ARMED, 0), (SessionState.OBSERVING, 1)])
def test_commands_that_end_mean_stop_and_an_observer_knows_none(
    bench: Bench, session: SessionState, unknown: int
) -> None:
    bench.notice(SessionState.ARMED)
    bench.hands()
    bench.commands()
    echo_s = bench.now_s
    for _ in range(25):
        bench.now_s += 0.004
        bench.notice(SessionState.ARMED)
        bench.hands(Button.L1, r2=1.0)
        bench.commands()
    for _ in range(2):  # Without a report of the controller nothing is sent.
        bench.now_s += 0.2
        bench.notice(session)
        assert bench.commands() == []
    header = Header(1, 100, bench.now_s, echo_sent_s=echo_s, echo_held_s=0.0)
    bench.feel_field(msgspec.structs.replace(uniform_update(header), r2=field(onsets(0.1)), horizon_m=1.0))
    assert bench.side.summary()["rendering"]["without_history"] == unknown
    # The last command counts until the end of commands is noted, 0.2 s later: δ = 0.25 * 0.296 = 74 mm, w = 0.
    assert unknown or bench.device.strengths[1] == (0,) * 3 + (8,) * 7


@pytest.mark.parametrize("fixed_task", [False, True])
def test_with_a_fixed_task_no_other_target_is_asked_for(fixed_task: bool) -> None:
    bench = Bench(fixed_task=fixed_task)
    bench.hands(Button.TRIANGLE, Button.L1)
    [command] = bench.commands()
    assert (command.run, command.next_target) == (True, not fixed_task)
