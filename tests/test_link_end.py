import pytest

from common.link_end import LinkEnd
from common.messages import Header, MotionCommand, StiffnessUpdate

CLOCK = "one clock"


def ends(robot_clock: str = CLOCK) -> tuple[LinkEnd, LinkEnd]:
    return LinkEnd("robot", 1, robot_clock), LinkEnd("operator", 2, CLOCK)


def motion(header: Header) -> MotionCommand:
    return MotionCommand(header, l2=0.0, r2=0.0)


def stiffness(header: Header) -> StiffnessUpdate:
    return StiffnessUpdate(header, l2=0.0, r2=0.0, rumble=0.0, state="armed")


def test_nothing_is_fresh_before_the_peer_said_hello() -> None:
    robot, operator = ends()
    assert not robot.arrived(motion(operator.stamp(0.0)), 0.01).fresh
    assert robot.stale == 1
    robot.arrived(operator.hello(0.02), 0.03)
    assert robot.arrived(motion(operator.stamp(0.04)), 0.05).fresh


def test_a_shared_clock_gives_one_way_delays_at_once() -> None:
    robot, operator = ends()
    robot.arrived(operator.hello(1.0), 1.03)
    arrival = robot.arrived(motion(operator.stamp(2.0)), 2.05)
    assert arrival.one_way_s == pytest.approx(0.05)
    assert robot.delay.count == 2
    assert robot.delay.mean == pytest.approx(0.04)


def test_clocks_that_differ_give_none_until_an_echo_came_back() -> None:
    robot, operator = ends(robot_clock="another clock")
    ahead_s = 1000.0  # the robot's clock
    arrival = robot.arrived(operator.hello(1.0), ahead_s + 1.02)
    assert arrival.one_way_s is None
    operator.arrived(robot.hello(ahead_s + 1.02), 1.04)
    for k in range(20):
        sent_s = 2.0 + k
        robot.arrived(motion(operator.stamp(sent_s)), ahead_s + sent_s + 0.02)
        operator.arrived(stiffness(robot.stamp(ahead_s + sent_s + 0.03)), sent_s + 0.05)
    arrival = robot.arrived(motion(operator.stamp(30.0)), ahead_s + 30.02)
    assert arrival.one_way_s == pytest.approx(0.02, abs=1e-6)
    assert robot.round_trip.mean == pytest.approx(0.04, abs=1e-6)


def test_the_loop_age_spans_both_ways_and_the_holding() -> None:
    robot, operator = ends()
    robot.arrived(operator.hello(0.0), 0.0)
    operator.arrived(robot.hello(0.0), 0.0)
    operator.arrived(stiffness(robot.stamp(1.0)), 1.05)  # 50 ms to the operator
    command = motion(operator.stamp(1.08))  # held for 30 ms
    arrival = robot.arrived(command, 1.10)  # 20 ms to the robot
    assert arrival.loop_age_s == pytest.approx(0.10)
    assert robot.round_trip.maximum == pytest.approx(0.07)


def test_the_newest_stamp_is_echoed_even_when_an_older_one_arrives_after_it() -> None:
    robot, operator = ends()
    operator.arrived(robot.hello(0.0), 0.0)
    older, newer = robot.stamp(1.0), robot.stamp(1.1)
    operator.arrived(stiffness(newer), 1.15)
    operator.arrived(stiffness(older), 1.16)
    echo = operator.stamp(1.2)
    assert echo.echo_sent_s == 1.1
    assert echo.echo_held_s == pytest.approx(0.05)


def test_reordered_and_repeated_messages_are_measured_but_never_fresh() -> None:
    robot, operator = ends()
    robot.arrived(operator.hello(0.0), 0.0)
    first, second = motion(operator.stamp(0.01)), motion(operator.stamp(0.02))
    assert robot.arrived(second, 0.05).fresh
    assert not robot.arrived(first, 0.06).fresh
    assert not robot.arrived(second, 0.07).fresh
    assert robot.stale == 2
    assert robot.delay.count == 4


def test_each_kind_of_message_has_its_own_order() -> None:
    robot, operator = ends()
    operator.arrived(robot.hello(0.0), 0.0)
    update = stiffness(robot.stamp(0.1))
    operator.arrived(robot.hello(0.2), 0.21)
    assert operator.arrived(update, 0.3).fresh


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
