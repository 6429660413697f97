"""Displacement by commands under way: equal to an integration in fine time steps, for any commands and times."""

import itertools
import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from common.protocol.messages import Header, MotionCommand
from operator_side.feel.blindness import Blindness
from operator_side.feel.commands_under_way import MAX_DELAY_S, CommandsUnderWay, Displacement, Report, _edges_s
from operator_side.feel.haptics import Haptics
from operator_side.feel.rendering import RenderingSettings
from operator_side.hands.travel_calibration import TravelCalibration
from tests.helpers.messages import uniform_update

FULL_M_S = 0.25
PERIOD_S = 0.004
STEPS = 200
TRAVEL = st.floats(-1.0, 1.0)
SPEED = st.floats(-0.3, 0.3)
ACCELERATION = st.floats(0.5, 20.0)
COMMANDS = st.lists(TRAVEL, min_size=1, max_size=60)


def sent_every(travels: list[float], period_s: float = PERIOD_S) -> CommandsUnderWay:
    """Return a history of commands, of which number i was sent after i periods."""
    commands = CommandsUnderWay()
    for index, travel in enumerate(travels):
        commands.sent(index * period_s, travel)
    return commands


def displacement(
    commands: CommandsUnderWay,
    now_s: float,
    echo_sent_s: float,
    echo_held_s: float = 0.0,
    speed_m_s: float = 0.0,
    acceleration_m_s2: float = 3.0,
    commanded_m_s: float | None = None,
) -> Displacement:
    report = Report(echo_sent_s, echo_held_s, speed_m_s, FULL_M_S, commanded_m_s)
    found = commands.displacement(now_s, report, acceleration_m_s2)
    assert found is not None
    return found


def stepped(travels: list[float], now_s: float, since_s: float, speed_m_s: float, acceleration: float) -> Displacement:
    """Compute the displacement by fine time steps, each within one command; command i holds from i periods on."""
    displacement_m, commands = (
        0.0,
        [index * PERIOD_S for index in range(len(travels)) if since_s < index * PERIOD_S < now_s],
    )
    for began_s, ended_s in itertools.pairwise([since_s, *commands, now_s]):
        target = FULL_M_S * travels[min(int((began_s + ended_s) / 2.0 / PERIOD_S), len(travels) - 1)]
        step_s = (ended_s - began_s) / STEPS
        for _ in range(STEPS):
            after = speed_m_s + min(max(target - speed_m_s, -acceleration * step_s), acceleration * step_s)
            displacement_m += 0.5 * (speed_m_s + after) * step_s
            speed_m_s = after
    return Displacement(displacement_m, speed_m_s)


@given(COMMANDS, SPEED)
def test_without_delay_nothing_is_under_way(travels: list[float], speed: float) -> None:
    newest_s = (len(travels) - 1) * PERIOD_S
    assert displacement(sent_every(travels), newest_s, newest_s, speed_m_s=speed) == Displacement(0.0, speed)
    held_s = 0.7 * PERIOD_S
    found = displacement(sent_every(travels), newest_s + held_s, newest_s, held_s, speed)
    assert found == pytest.approx((0.0, speed), abs=1e-12)


@given(COMMANDS, SPEED, ACCELERATION, st.data())
@example([0.0, 1.0, 1.0, -1.0, 0.5], 0.1, 20.0, None)
def test_it_is_what_a_fine_stepping_of_time_gives(
    travels: list[float], speed: float, acceleration: float, data: st.DataObject | None
) -> None:
    echo = 0 if data is None else data.draw(st.integers(0, len(travels) - 1))
    held_s = PERIOD_S * (0.25 if data is None else data.draw(st.floats(0.0, 1.0)))
    echo_s = echo * PERIOD_S
    now_s = (len(travels) - 1) * PERIOD_S + 0.01
    found = displacement(sent_every(travels), now_s, echo_s, held_s, speed, acceleration)
    reference = stepped(travels, now_s, echo_s + held_s, speed, acceleration)
    assert found.displacement_m == pytest.approx(reference.displacement_m, abs=2e-6)
    assert found.speed_m_s == pytest.approx(reference.speed_m_s, abs=2e-3)


@given(COMMANDS, SPEED, ACCELERATION, st.floats(0.0, 0.3), st.data())
def test_drives_that_respond_later_follow_what_was_sent_earlier(
    travels: list[float], speed: float, acceleration: float, response_s: float, data: st.DataObject
) -> None:
    echo_s = data.draw(st.integers(0, len(travels) - 1)) * PERIOD_S
    now_s, held_s = (len(travels) - 1) * PERIOD_S + 0.01, 0.001
    report = Report(echo_s, held_s, speed, FULL_M_S, None, response_s)
    found = sent_every(travels).displacement(now_s, report, acceleration)
    assert found is not None
    # Before the first command nothing is known, and nothing counts.
    reference = stepped(travels, now_s, max(echo_s + held_s - response_s, 0.0), speed, acceleration)
    assert found.displacement_m == pytest.approx(reference.displacement_m, abs=2e-6)
    assert found.speed_m_s == pytest.approx(reference.speed_m_s, abs=2e-3)


@given(COMMANDS, SPEED, TRAVEL, st.data())
def test_the_speed_given_to_the_newest_command_replaces_the_speed_asked_for(
    travels: list[float], speed: float, gives: float, data: st.DataObject
) -> None:
    echo = data.draw(st.integers(0, len(travels) - 1))
    moment = len(travels) * PERIOD_S, echo * PERIOD_S, 0.001, speed
    found = displacement(sent_every(travels), *moment, commanded_m_s=gives * FULL_M_S)
    travels[echo] = gives
    assert found == pytest.approx(displacement(sent_every(travels), *moment), abs=1e-12)


@given(st.lists(st.floats(-0.1, 0.1), min_size=1, max_size=60), SPEED, ACCELERATION, st.data())
def test_a_course_beside_a_stick_that_costs_no_time_goes_the_same_way(
    changes: list[float], speed: float, acceleration: float, data: st.DataObject
) -> None:
    """A course follows the mean command of each 10 ms, so that it differs a little from `displacement`."""
    commands, now_s, travel = CommandsUnderWay(), (len(changes) - 1) * PERIOD_S + 0.01, 0.0
    for index, change in enumerate(changes):
        travel = min(max(travel + change, -1.0), 1.0)
        commands.sent(index * PERIOD_S, travel, (1.0, 0.0, 0.0, 0.0))
    report = Report(data.draw(st.integers(0, len(changes) - 1)) * PERIOD_S, 0.001, speed, FULL_M_S)
    expected = commands.displacement(now_s, report, acceleration)
    course = commands.course(now_s, report, np.array([[FULL_M_S / acceleration, 0.0, 0.0, 0.0, 0.0]]))
    assert expected is not None
    assert course is not None
    assert course.displacements_m[-1] == pytest.approx(expected.displacement_m, abs=5e-4)


def test_a_command_that_had_not_come_when_it_should_have_is_still_under_way() -> None:
    # At the report, the robot side had held the command of 0 ms for 30 ms. So the command of 4 ms arrives with the
    # report or later.
    commands = sent_every([1.0] + [0.0] * 24)
    speed = 0.25
    late = displacement(commands, 0.1, 0.0, 0.030, speed)
    assert late == displacement(commands, 0.1, 0.0, 0.004, speed)
    assert late.displacement_m == pytest.approx(speed**2 / (2.0 * 3.0))
    # Without a later command, `held` is used unchanged.
    alone = sent_every([1.0])
    assert displacement(alone, 0.1, 0.0, 0.030, speed).displacement_m == pytest.approx(0.07 * speed)


@pytest.mark.parametrize(
    ("echo_sent_s", "echo_held_s"),
    [
        (None, None),
        (None, 0.0),
        (5.0, None),
        (2.9, 0.0),
        (5.1, 0.0),
        (4.9, 0.102),
        (4.9, -0.001),
        (math.nan, 0.0),
        (4.9, math.nan),
        (-math.inf, 0.0),
        (4.9, math.inf),
    ],
)
def test_without_an_echo_that_history_reaches_back_to_there_is_no_answer(
    echo_sent_s: float | None, echo_held_s: float | None
) -> None:
    commands = CommandsUnderWay()
    for tick in range(501):
        commands.sent(0.01 * tick, 0.5)
    assert commands.displacement(5.0, Report(echo_sent_s, echo_held_s, 0.1, FULL_M_S), 3.0) is None
    assert commands.displacement(5.0, Report(3.0, 0.0, 0.1, FULL_M_S), 3.0) is not None


def test_memory_is_bounded_whatever_the_rate() -> None:
    commands = CommandsUnderWay()
    for tick in range(10_000):
        commands.sent(1e-6 * tick, 0.0)
    assert len(commands) == 4096
    # Commands that have left the history are unknown; they do not count as zero.
    assert commands.displacement(0.01, Report(0.001, 0.0, 0.0, FULL_M_S), 3.0) is None
    for tick in range(2000):
        commands.sent(1.0 + PERIOD_S * tick, 0.0)
    assert len(commands) <= MAX_DELAY_S / PERIOD_S + 2
    short = CommandsUnderWay(window_s=0.1)
    for tick in range(100):
        short.sent(PERIOD_S * tick, 0.0)
    assert len(short) <= 0.1 / PERIOD_S + 2


def test_what_cannot_be_is_refused() -> None:
    commands, nan, inf = sent_every([0.0, 0.0]), math.nan, math.inf
    sent = ((1.0, 1.001), (1.0, nan), (0.0, 0.0), (inf, 0.0))
    reports = ((nan, 0.25, 3.0), (0.0, 0.0, 3.0), (0.0, inf, 3.0), (0.0, 0.25, 0.0), (0.0, 0.25, nan))
    refused: list[Callable[[], object]] = [
        *(partial(commands.sent, *values) for values in sent),
        *(partial(commands.displacement, 0.01, Report(0.0, 0.0, *speeds), most) for *speeds, most in reports),
        *(partial(CommandsUnderWay, window_s) for window_s in (0.0, -1.0, inf, nan)),
    ]
    for call in refused:
        with pytest.raises(ValueError, match="valid: "):
            call()


@pytest.mark.parametrize(("homes", "expected"), [(1, [False, True, True]), (2, [False, False, True])])
def test_on_the_way_home_the_robot_sides_reckoning_holds_until_the_last_such_command_is_echoed(
    homes: int, expected: list[bool]
) -> None:
    haptics = Haptics(RenderingSettings(), TravelCalibration(), enabled=True, swap_sides=False, compensation="operator")
    for number in range(4):
        header, home = Header(2, number, 0.1 * number), float(1 <= number <= homes)
        haptics.commanded(MotionCommand(header, l2=0.0, r2=0.0, run=True, home=home))
    known = []
    for echo in (0, 1, 2):
        before = haptics.without_history
        header = Header(1, 1, 0.4, echo_sent_s=0.1 * echo, echo_held_s=0.0)
        haptics.due(uniform_update(header), (0.0, 0.0), Blindness(), 0.4)
        known.append(haptics.without_history == before)
    assert known == expected


@pytest.mark.parametrize("under_way_s", [0.0, 0.004, 0.1, 0.357, MAX_DELAY_S])
def test_a_course_is_followed_in_steps_of_at_most_10_ms(under_way_s: float) -> None:
    """A stick that is swapped has turned the path within a step or two."""
    edges_s, before = _edges_s(1.0, 1.0 + under_way_s)
    assert edges_s[before] == 1.0
    assert edges_s[-1] == pytest.approx(1.0 + under_way_s)
    assert (np.diff(edges_s) >= 0.0).all()
    assert np.diff(edges_s).max() <= 0.01 + 1e-12
