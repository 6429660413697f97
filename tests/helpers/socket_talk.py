"""Real sockets on loopback that connect and exchange messages."""

from collections.abc import Callable

import pytest

from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets

EPHEMERAL = "tcp://127.0.0.1:0"
PATIENT_S = 60.0
"""Longest silence of a connection in seconds"""
ROUNDS = 60_000
"""Number of waits of 10 ms after which a test gives up."""


def send_until_connected(operator: OperatorSockets, payload: bytes) -> None:
    for _ in range(ROUNDS):
        if operator.send(payload):
            return
        operator.wait(0.01)
    pytest.fail("no connection")


def receive_some(robot: RobotSockets) -> list[tuple[bytes, bytes]]:
    """Return the next messages that arrive; a wait ends for handshakes, too."""
    for _ in range(ROUNDS):
        if messages := robot.receive():
            return messages
        robot.wait(0.01)
    pytest.fail("no message")


def receive_one(robot: RobotSockets) -> tuple[bytes, bytes]:
    (message,) = receive_some(robot)
    return message


def greet(robot: RobotSockets, operator: OperatorSockets) -> bytes:
    """Send until all connections of `operator` are up; return the name that the robot side has for `operator`."""
    connections = len(operator._connections)
    for _ in range(ROUNDS):
        if not operator.send(b"hello"):
            robot.wait(0.01)  # The wait answers handshakes, too.
            continue
        for _ in range(ROUNDS // 60):  # What was sent on a connection that has just broken off is lost.
            robot.wait(0.01)
            names = [name for name, payload in robot.receive() if payload == b"hello"]
            if names:
                break
        peer = robot._peers.get(names[0]) if names else None
        if peer is not None and len(peer.round_robin.connections) == connections:
            return names[0]
        robot.wait(0.01)  # Else it would count as flooding.
        operator.receive()  # This connects again after a refused handshake.
    pytest.fail("some connections do not come up")


def publish_until_seen(robot: RobotSockets, operator: OperatorSockets, topic: bytes) -> None:
    """Publish on `topic` until the subscription is active and a message has reached the operator side."""
    for _ in range(ROUNDS):
        robot.publish(topic, b"probe")
        if operator.wait(0.01):
            return
    pytest.fail("no subscription")


def drain_until(received: Callable[[], list[bytes]], wait: Callable[[float], bool], last: bytes) -> list[bytes]:
    """Return all messages received until `last` has come; on several connections `last` may overtake others."""
    messages: list[bytes] = []
    for _ in range(ROUNDS):
        messages += received()
        if last in messages:
            return messages
        wait(0.01)
    return pytest.fail(f"{last!r} did not arrive")


def drain_all(received: Callable[[], list[bytes]], wait: Callable[[float], bool], expected: list[bytes]) -> None:
    """Receive as many messages as `expected` has; assert that they are these, in any order."""
    messages: list[bytes] = []
    for _ in range(ROUNDS):
        messages += received()
        if len(messages) >= len(expected):
            break
        wait(0.01)
    assert sorted(messages) == sorted(expected)
