import math
from collections.abc import Callable, Iterator
from heapq import heappop, heappush

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.link_end import LinkEnd
from common.protocol.messages import AnyMessage, Header, MotionCommand
from tests.helpers.clock_exchanges import ahead
from tests.helpers.messages import uniform_update

CLOCK = "one clock"


def ends(robot_clock: str = CLOCK) -> tuple[LinkEnd, LinkEnd]:
    return LinkEnd("robot", 1, robot_clock), LinkEnd("operator", 2, CLOCK)


def motion(header: Header) -> MotionCommand:
    return MotionCommand(header, l2=0.0, r2=0.0)


def test_nothing_is_fresh_before_the_peer_said_hello() -> None:
    robot, operator = ends()
    assert not robot.arrived(motion(operator.stamp(0.0)), 0.01).fresh
    assert robot.stale == 1
    robot.arrived(operator.hello(0.02), 0.03)
    assert robot.arrived(motion(operator.stamp(0.04)), 0.05).fresh


def test_the_loop_age_spans_both_ways_and_the_holding() -> None:
    robot, operator = ends()
    robot.arrived(operator.hello(0.0), 0.0)
    operator.arrived(robot.hello(0.0), 0.0)
    operator.arrived(uniform_update(robot.stamp(1.0)), 1.05)  # 50 ms to the operator
    command = motion(operator.stamp(1.08))  # Held for 30 ms, of which 16 need no message.
    arrival = robot.arrived(command, 1.10)  # 20 ms to the robot
    assert arrival.loop_age_s == pytest.approx(0.084)
    assert robot.round_trip.maximum == pytest.approx(0.07)


def test_a_copy_is_measured_and_neither_fresh_nor_stale_and_what_was_overtaken_is_stale() -> None:
    robot, operator = ends()
    opening = operator.hello(0.0)
    for message in (opening, motion(operator.stamp(0.01)), operator.hello(0.02)):
        assert robot.arrived(message, 0.05).fresh
        copy = robot.arrived(message, 0.06)
        assert not copy.fresh
        assert copy.one_way_s == 0.06 - message.header.sent_s
    assert (robot.stale, robot.delay.count) == (0, 6)
    assert robot.delay.mean == pytest.approx(0.045)
    overtaken = motion(operator.stamp(0.03))
    robot.arrived(motion(operator.stamp(0.04)), 0.07)
    # Over several connections with jitter, a copy may come long after newer messages, and before or after the first.
    for message, came_before in ((opening, True), (overtaken, False), (overtaken, True)):
        arrival = robot.arrived(message, 0.08)
        assert (arrival.fresh, arrival.copy) == (False, came_before)
    assert robot.stale == 1


def test_copies_are_known_up_to_a_distance_and_an_invented_number_costs_nothing() -> None:
    robot, operator = ends()
    robot.arrived(operator.hello(0.0), 0.0)
    first = motion(operator.stamp(0.0, 2))
    for ahead_by in (1023, 1024, 2**50):
        assert robot.arrived(first, 0.0).copy == (ahead_by == 1024)
        assert robot.arrived(motion(operator.stamp(0.0, 2 + ahead_by)), 0.0).fresh
    assert not robot.arrived(first, 0.0).copy
    assert robot.arrived(motion(operator.stamp(0.0, 2 + 2**50)), 0.0).copy


def test_an_epoch_that_ended_never_comes_back() -> None:
    robot, operator = ends()
    old_hello, old_motion = operator.hello(0.0), motion(operator.stamp(0.1))
    robot.arrived(old_hello, 0.05)
    restarted = LinkEnd("operator", 3, CLOCK)
    robot.arrived(restarted.hello(1.0), 1.05)
    assert robot.peer_epoch == 3
    assert not robot.arrived(old_hello, 1.1).fresh
    assert not robot.arrived(old_motion, 1.1).fresh
    assert robot.peer_epoch == 3
    assert robot.arrived(motion(restarted.stamp(1.1)), 1.15).fresh


def test_an_invented_echo_is_not_measured() -> None:
    robot, operator = ends()
    robot.arrived(operator.hello(0.0), 0.0)
    invented = Header(epoch=2, sequence=99, sent_s=1.0, echo_sent_s=5.0, echo_held_s=0.0)
    arrival = robot.arrived(motion(invented), 1.01)
    assert arrival.loop_age_s is None
    assert robot.round_trip.count == 0


Delay = Callable[[np.random.Generator], float]
AHEAD_S = 7e4


def talk(
    robot: LinkEnd, operator: LinkEnd, delays: tuple[Delay, Delay], skew: float, duration_s: float
) -> Iterator[tuple[LinkEnd, float, float | None]]:
    """Let both ends send every 4 ms; yield at each arrival the end, our time, and the error of its one-way delay.

    delays: to the robot and to the operator; infinite for a lost message. skew: seconds that the operator's clock gains
    in a second.
    """
    generator, clock = np.random.default_rng(4), ahead(AHEAD_S, skew)
    waiting: list[tuple[float, int, LinkEnd, AnyMessage, float]] = []
    for number in range(round(duration_s / 0.002)):
        now_s = 0.002 * number
        while waiting and waiting[0][0] <= now_s:
            at_s, _, end, message, delay_s = heappop(waiting)
            one_way_s = end.arrived(message, at_s if end is robot else clock(at_s)).one_way_s
            yield end, at_s, None if one_way_s is None else one_way_s - delay_s
        end, other = ((robot, operator), (operator, robot))[number % 2]
        own_s = now_s if end is robot else clock(now_s)
        say = end.hello if end.peer_epoch is None or now_s < 0.25 else lambda at_s, end=end: motion(end.stamp(at_s))
        delay_s = delays[end is robot](generator)
        if math.isfinite(delay_s):
            heappush(waiting, (now_s + delay_s, number, other, say(own_s), delay_s))


def offset_error_s(robot: LinkEnd, end: LinkEnd, at_s: float, skew: float) -> float | None:
    theirs_s = ahead(AHEAD_S, skew)(at_s)
    ours_s, true_s = (at_s, theirs_s - at_s) if end is robot else (theirs_s, at_s - theirs_s)
    offset_s = end.clock_offset.offset_at(ours_s)
    return None if offset_s is None else offset_s - true_s


def queues(spread_s: float) -> Delay:
    return lambda generator: 0.050 + float(generator.exponential(spread_s))


@pytest.mark.parametrize("to_operator", [queues(0.010), queues(0.001)])
@pytest.mark.parametrize("skew", [20e-6, -100e-6])
def test_both_ends_know_the_offset_after_five_seconds_of_queues(to_operator: Delay, skew: float) -> None:
    robot, operator = ends(robot_clock="another clock")
    found = {
        end: (at_s, error_s) for end, at_s, error_s in talk(robot, operator, (queues(0.010), to_operator), skew, 5)
    }
    for end, (at_s, one_way_error_s) in found.items():
        error_s = offset_error_s(robot, end, at_s, skew)
        assert error_s is not None
        assert one_way_error_s is not None
        assert abs(error_s) < 0.5e-3
        assert abs(one_way_error_s) < 0.5e-3


def test_delays_count_once_the_offset_has_settled() -> None:
    robot, operator = ends(robot_clock="another clock")
    robot.arrived(operator.hello(0.0), 500.02)
    operator.arrived(robot.hello(500.02), 0.04)
    for k in range(60):
        sent_s = 0.1 + 0.05 * k
        arrival = robot.arrived(motion(operator.stamp(sent_s)), 500.02 + sent_s)
        operator.arrived(uniform_update(robot.stamp(500.02 + sent_s)), sent_s + 0.04)
        assert arrival.one_way_s is not None
    assert robot.delay.count == 39
    assert robot.delay.mean == pytest.approx(0.02, abs=20e-6)


def test_a_new_epoch_forgets_the_offset_and_all_that_hung_on_it() -> None:
    robot, operator = ends(robot_clock="another clock")
    robot.arrived(operator.hello(0.0), 500.02)
    operator.arrived(robot.hello(500.02), 0.04)
    robot.arrived(motion(operator.stamp(0.1)), 500.12)
    assert robot.offset_summary_ms()["value"] == pytest.approx(-500.0e3, abs=0.1)
    restarted = LinkEnd("operator", 3, "a clock after a reboot")
    arrival = robot.arrived(restarted.hello(9000.0), 501.0)
    assert arrival.one_way_s is None
    assert arrival.queueing_age_s == 0.0
    assert robot.offset_summary_ms()["value"] is None
    assert robot.offset_summary_ms()["bound"] is None
    assert robot.stamp(501.1).echo_sent_s == 9000.0


@pytest.mark.parametrize("slept_s", [0.5, 600.0])
def test_a_peer_that_slept_is_followed_and_its_messages_are_not_old_for_ever(slept_s: float) -> None:
    robot, operator = ends(robot_clock="another clock")
    robot.arrived(operator.hello(0.0), 500.02)
    operator.arrived(robot.hello(500.02), 0.04)
    true_s, ages_s = 0.1, []
    for k in range(1000):
        # The operator's machine is suspended once: meanwhile its monotonic clock stops.
        ahead_s = 500.0 if k < 500 else 500.0 + slept_s
        true_s = 0.1 + 0.05 * k + (0.0 if k < 500 else slept_s)
        arrival = robot.arrived(motion(operator.stamp(true_s + 500.0 - ahead_s)), true_s + 500.02)
        operator.arrived(uniform_update(robot.stamp(true_s + 500.02)), true_s + 500.04 - ahead_s)
        ages_s.append(arrival.queueing_age_s)
    assert robot.clock_offset.jumps == 1
    assert ages_s[500] == pytest.approx(slept_s, abs=1e-6)
    assert max(ages_s[520:]) < 1e-6
    assert arrival.one_way_s == pytest.approx(0.02, abs=1e-3)


stamp = st.floats(allow_nan=False, allow_infinity=False) | st.floats(0.0, 60.0)
hold = st.floats(0.0, 1e9) | st.floats(0.0, 0.1)
invented = st.lists(st.tuples(stamp, stamp, hold, stamp, hold), min_size=1, max_size=12)


@given(st.lists(invented, min_size=1, max_size=4), st.booleans())
def test_a_peer_that_invents_stamps_spoils_nothing_for_long(
    bouts: list[list[tuple[float, float, float, float, float]]], shared: bool
) -> None:
    robot, operator = ends(robot_clock=CLOCK if shared else "another clock")
    ahead_s, now_s, sequence = 0.0 if shared else 500.0, 1.0, 10**6
    robot.arrived(operator.hello(now_s), ahead_s + now_s + 0.02)
    operator.arrived(robot.hello(ahead_s + now_s + 0.02), now_s + 0.04)
    for bout in bouts:
        for sent_s, echo_s, echo_held_s, last_s, last_held_s in bout:
            sequence, now_s = sequence + 1, now_s + 0.05
            header = Header(2, sequence, sent_s, echo_s, echo_held_s, last_s, last_held_s)
            one_way_s = robot.arrived(motion(header), ahead_s + now_s).one_way_s
            assert one_way_s is None or math.isfinite(one_way_s)
        for _ in range(40):
            now_s += 0.05
            arrival = robot.arrived(motion(operator.stamp(now_s)), ahead_s + now_s + 0.02)
            operator.arrived(uniform_update(robot.stamp(ahead_s + now_s + 0.02)), now_s + 0.04)
        assert arrival.one_way_s is not None
        assert 0.0 <= arrival.one_way_s < 0.1
        bound_s, offset_s = robot.clock_offset.bound_s, robot.clock_offset.offset_s
        assert bound_s is not None
        assert offset_s is not None
        assert abs(offset_s + ahead_s) <= bound_s


def test_an_overtaken_message_is_echoed_beside_the_newest() -> None:
    robot, operator = ends()
    operator.arrived(robot.hello(0.0), 0.0)
    older, newer = robot.stamp(1.0), robot.stamp(1.1)
    operator.arrived(uniform_update(newer), 1.15)
    assert operator.stamp(1.155).last_sent_s is None
    operator.arrived(uniform_update(older), 1.16)
    echo = operator.stamp(1.2)
    assert (echo.echo_sent_s, echo.last_sent_s) == (1.1, 1.0)
    assert echo.last_held_s == pytest.approx(0.04)
    operator.arrived(uniform_update(robot.stamp(1.2)), 1.25)
    assert operator.stamp(1.26).last_sent_s is None


def test_gaps_are_silences_of_more_than_100_ms_that_something_newer_ended() -> None:
    robot, operator = ends()
    robot.arrived(operator.hello(0.0), 0.0)
    early, late = motion(operator.stamp(0.05)), motion(operator.stamp(0.1))
    robot.arrived(late, 0.2)
    robot.arrived(early, 0.21)
    robot.arrived(motion(operator.stamp(0.25)), 0.29)
    assert robot.gaps == 1
