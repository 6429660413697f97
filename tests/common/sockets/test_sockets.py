"""Real sockets on loopback. Nothing here sleeps: each wait ends with a message, or after a limit."""

import os

import pytest

from common.clock import VirtualClock
from common.sockets import inbox
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from common.sockets.shell import CONTROL_LIMIT_BYTES, VIEW_LIMIT_BYTES
from tests.helpers.socket_talk import (
    EPHEMERAL,
    PATIENT_S,
    ROUNDS,
    drain_all,
    drain_until,
    greet,
    publish_until_seen,
    receive_one,
    send_until_connected,
)


def test_a_peer_that_left_is_counted(robot: RobotSockets, operator: OperatorSockets) -> None:
    peer = greet(robot, operator)
    operator.close()
    for _ in range(ROUNDS):
        if not robot.send(peer, b"stiffness"):
            break
        robot.wait(0.01)
    assert robot.dropped == 1


def test_nothing_is_kept_for_a_robot_that_is_not_there() -> None:
    with RobotSockets(EPHEMERAL) as robot:
        control, view = robot.control_endpoint, robot.view_endpoint
    with OperatorSockets(control, view) as operator:
        assert [operator.send(b"stale") for _ in range(3)] == [False] * 3
        assert operator.dropped == 3
        with RobotSockets(control, view) as late:
            send_until_connected(operator, b"fresh")
            assert receive_one(late)[1] == b"fresh"


def test_a_flood_never_blocks_and_what_was_taken_arrives(robot: RobotSockets, operator: OperatorSockets) -> None:
    peer = greet(robot, operator)
    taken = [number for number in range(20_000) if robot.send(peer, b"%d" % number)]
    assert len(taken) + robot.dropped == 20_000
    assert robot.dropped > 0
    drain_all(operator.receive, operator.wait, [b"%d" % number for number in taken])


def test_one_call_receives_a_bounded_number(
    robot: RobotSockets, operator: OperatorSockets, monkeypatch: pytest.MonkeyPatch
) -> None:
    greet(robot, operator)
    monkeypatch.setattr(inbox, "MESSAGES_PER_RECEIVE", 3)
    sent = [b"%d" % number for number in range(8)]
    for payload in sent:
        send_until_connected(operator, payload)
    batches: list[list[bytes]] = []

    def receive() -> list[bytes]:
        batches.append([payload for _, payload in robot.receive()])
        return batches[-1]

    drain_all(receive, robot.wait, sent)
    assert max(len(batch) for batch in batches) <= 3


def test_refuses_to_send_more_than_the_other_side_accepts(robot: RobotSockets, operator: OperatorSockets) -> None:
    peer = greet(robot, operator)
    for send in (operator.send, lambda payload: robot.send(peer, payload)):
        with pytest.raises(ValueError, match=f"{CONTROL_LIMIT_BYTES + 1} bytes; valid: up to {CONTROL_LIMIT_BYTES}"):
            send(bytes(CONTROL_LIMIT_BYTES + 1))
        assert send(bytes(CONTROL_LIMIT_BYTES))
    with pytest.raises(ValueError, match=f"valid: up to {VIEW_LIMIT_BYTES}"):
        robot.publish(b"video", bytes(VIEW_LIMIT_BYTES + 1))


def test_only_the_topics_asked_for_arrive(robot: RobotSockets) -> None:
    with OperatorSockets(robot.control_endpoint, robot.view_endpoint, topics=[b"telemetry"]) as operator:
        for _ in range(ROUNDS):
            robot.publish(b"video", b"frame")
            robot.publish(b"telemetry", b"state")
            if operator.wait(0.01):
                break
        assert {topic for topic, _ in operator.receive_view()} == {b"telemetry"}


def test_the_operator_wakes_on_either_socket(robot: RobotSockets, operator: OperatorSockets) -> None:
    publish_until_seen(robot, operator, b"telemetry")
    robot.publish(b"telemetry", b"last probe")
    drain_until(lambda: [payload for _, payload in operator.receive_view()], operator.wait, b"last probe")
    robot.publish(b"telemetry", b"state")
    assert operator.wait(PATIENT_S)
    assert operator.receive() == []
    assert operator.receive_view() == [(b"telemetry", b"state")]
    peer = greet(robot, operator)
    robot.send(peer, b"stiffness")
    assert operator.wait(PATIENT_S)
    assert operator.receive_view() == []
    assert operator.receive() == [b"stiffness"]


def test_signals_that_bring_nothing_prolong_no_wait(robot: RobotSockets, monkeypatch: pytest.MonkeyPatch) -> None:
    """Strangers who connect again and again must not delay the robot side's next tick."""
    clock, (reading, writing) = VirtualClock(), os.pipe()
    os.write(writing, b"nobody reads it")

    def looked() -> bool:
        clock.advance_to(clock.now() + 0.01)
        assert clock.now() < 2.0
        return False

    for owner, name, stand_in in (
        (robot, "_clock", clock),
        *((robot._inbox, "descriptor", reading), (robot._inbox, "has_some", looked)),
    ):
        monkeypatch.setattr(owner, name, stand_in)
    assert not robot.wait(1.0)
    assert clock.now() == pytest.approx(1.0, abs=0.03)
    for descriptor in (reading, writing):
        os.close(descriptor)
