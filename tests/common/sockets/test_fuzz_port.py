import contextlib
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from common.clock import VirtualClock
from common.periods import TURN_S
from common.sockets import gate
from common.sockets import robot as robot_sockets
from common.sockets.allow_list import AllowList
from common.sockets.authentication import RobotKeys, make_key_pair
from common.sockets.keys import KeyFolder
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from common.sockets.shell import CONTROL_LIMIT_BYTES
from tests.helpers.hostile.inputs import Attacker
from tests.helpers.hostile.raw_zmtp import GREETING, RawConnection, frame, message, port_of, ready
from tests.helpers.socket_talk import EPHEMERAL, PATIENT_S, ROUNDS


@pytest.fixture
def operator(robot: RobotSockets) -> Iterator[OperatorSockets]:
    with OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as opened:
        assert is_heard(robot, opened)
        yield opened


def is_heard(robot: RobotSockets, operator: OperatorSockets) -> bool:
    """Return whether a message of the operator arrives and an answer comes back, among any other messages."""
    for _ in range(ROUNDS):
        operator.send(b"operator")
        robot.wait(0.01)
        for peer, payload in robot.receive():
            if payload == b"operator":
                robot.send(peer, b"answer")
        if operator.wait(0.01) and b"answer" in operator.receive():
            return True
    return False


def stranger(robot: RobotSockets) -> RawConnection:
    return RawConnection.introduced(port_of(robot.control_endpoint))


def drain(robot: RobotSockets, limit_s: float = 0.1) -> list[bytes]:
    """Return all messages; the first may take `limit_s`, each further one 0.1 s."""
    received: list[bytes] = []
    while robot.wait(0.1 if received else limit_s):
        received += [payload for _, payload in robot.receive()]
    return received


def descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def until_descriptors_are(count: int, robot: RobotSockets) -> bool:
    for _ in range(ROUNDS):
        if descriptors() <= count:
            return True
        robot.wait(0.01)
        robot.receive()
    return False


def test_two_thousand_hostile_inputs_leave_the_operator_heard_and_no_descriptor_behind(
    robot: RobotSockets, operator: OperatorSockets
) -> None:
    before = descriptors()
    attacker = Attacker(port_of(robot.control_endpoint), port_of(robot.view_endpoint), seed=0)
    for number in range(2000):
        attacker.send()
        if number % 20 == 0:
            robot.receive()
        if number % 200 == 0:
            assert is_heard(robot, operator)
    attacker.close()
    assert is_heard(robot, operator)
    assert until_descriptors_are(before, robot)


def test_a_connection_that_never_introduces_itself_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    # CURVE's two round trips, at the longest loop age that a session bears.
    assert 2.0 * 2.0 < robot_sockets.HANDSHAKE_LIMIT_S < 10.0
    monkeypatch.setattr(robot_sockets, "HANDSHAKE_LIMIT_S", 0.2)
    with RobotSockets(EPHEMERAL) as robot:
        slow = [RawConnection(port_of(robot.control_endpoint), GREETING[:length]) for length in (0, 1, 10, 63, 64)]
        assert all(connection.ended() for connection in slow)


def test_a_crowd_is_hung_up_on_and_connected_peers_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_sockets, "MOST_CONNECTIONS", 20)
    with (
        RobotSockets(EPHEMERAL, heartbeat_timeout_s=PATIENT_S) as robot,
        OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as operator,
    ):
        assert is_heard(robot, operator)
        for endpoint in (robot.control_endpoint, robot.view_endpoint):
            before = robot.crowded
            crowd = [RawConnection(port_of(endpoint)) for _ in range(100)]
            assert any(robot.crowded >= before + 80 for _ in range(ROUNDS) if robot.wait(0.01) or not robot.receive())
            assert all(connection.ended() for connection in crowd[:70])
            assert is_heard(robot, operator)
            for connection in crowd:
                connection.close()
        [told] = robot.news()
        assert "more than 20 connections at once" in told
        assert robot.news() == []
        # A fast newcomer still gets in.
        with OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as late:
            assert is_heard(robot, late)


def come_and_go(robot: RobotSockets, endpoint: str, count: int) -> None:
    """Let `count` strangers connect and leave while the robot side reads nothing."""
    before = descriptors()
    crowd = [RawConnection(port_of(endpoint)) for _ in range(count)]
    assert any(descriptors() >= before + 2 * count for _ in range(ROUNDS) if not robot.wait(0.01))
    for connection in crowd:
        connection.close()
    assert any(descriptors() <= before for _ in range(ROUNDS) if not robot.wait(0.01))


def test_the_new_owner_of_a_strangers_descriptor_is_not_hung_up_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_sockets, "MOST_CONNECTIONS", 20)
    monkeypatch.setattr(gate, "_EVENTS_PER_CALL", 10)
    hung_up: list[int] = []
    for module in (gate, robot_sockets):
        monkeypatch.setattr(module, "shut_down", hung_up.append)
    with RobotSockets(EPHEMERAL, heartbeat_timeout_s=PATIENT_S) as robot:
        come_and_go(robot, robot.view_endpoint, 100)
        with OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as operator:
            assert is_heard(robot, operator)
            for _ in range(50):
                robot.receive()
            assert hung_up == []
            assert robot._ports.all_seen


def test_the_largest_message_that_is_allowed_arrives_and_the_next_larger_does_not(robot: RobotSockets) -> None:
    with contextlib.closing(stranger(robot)) as connection:
        connection.send(message(bytes(CONTROL_LIMIT_BYTES)))
        assert drain(robot, PATIENT_S) == [bytes(CONTROL_LIMIT_BYTES)]
        connection.send(message(bytes(CONTROL_LIMIT_BYTES + 1)))
        assert drain(robot) == []
        assert connection.ended()


@pytest.mark.parametrize("frames", [2, 3, 100, 20_000])
def test_a_message_of_too_many_frames_is_dropped_in_bounded_steps(
    robot: RobotSockets, operator: OperatorSockets, frames: int
) -> None:
    with contextlib.closing(stranger(robot)) as connection:
        connection.send(message(*[b"x"] * frames) + message(b"last"))
        steps = 0
        for _ in range(ROUNDS):
            robot.wait(0.05)
            steps += 1
            if b"last" in [payload for _, payload in robot.receive()]:
                break
        assert robot.rejected == 1
        assert steps >= frames // 128  # 64 messages of two frames in each call
        assert is_heard(robot, operator)


def test_a_peer_that_floods_is_cut_off_and_the_operator_is_not(
    robot: RobotSockets, operator: OperatorSockets, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert round(20 / TURN_S) == robot_sockets.PEER_LIMIT_PER_S
    monkeypatch.setattr(robot_sockets, "PEER_LIMIT_PER_S", 200)
    monkeypatch.setattr(robot, "_second", 0)
    monkeypatch.setattr(robot, "_clock", VirtualClock())  # All messages fall into one second.
    received = 0
    with contextlib.closing(stranger(robot)) as connection:
        for _ in range(ROUNDS):
            connection.send(message(b"flood") * 10)
            received += [payload for _, payload in robot.receive()].count(b"flood")
            if not connection.open:
                break
        assert connection.ended()
    assert robot.flooding > 0
    assert received <= 200
    assert is_heard(robot, operator)


def test_the_view_port_takes_nothing_large_and_survives_garbage(robot: RobotSockets, operator: OperatorSockets) -> None:
    generator = random.Random(2)  # noqa: S311
    port = port_of(robot.view_endpoint)
    for _ in range(100):
        RawConnection(port, generator.randbytes(100)).close()
    greedy = RawConnection.introduced(port, b"SUB")
    greedy.send(frame(b"\x01", claimed_bytes=2**40))
    assert greedy.ended()
    for _ in range(ROUNDS):
        robot.publish(b"telemetry", b"state")
        if operator.wait(0.01) and operator.receive_view():
            return
    pytest.fail("the viewer sees nothing any more")


def test_with_keys_no_raw_peer_of_any_version_gets_a_byte_to_the_codec(tmp_path: Path) -> None:
    generator = random.Random(3)  # noqa: S311
    keys = RobotKeys(make_key_pair()[1], AllowList(KeyFolder(tmp_path)))
    with RobotSockets(EPHEMERAL, keys=keys) as robot:
        port = port_of(robot.control_endpoint)
        for _ in range(100):
            RawConnection(port, generator.randbytes(200)).close()
            # Old peers introduce themselves by a short frame, without a mechanism.
            RawConnection(port, b"\x01\x00" + frame(b"payload")).close()
            RawConnection(port, GREETING + ready(b"DEALER") + message(b"payload")).close()
        assert drain(robot) == []
        assert robot.rejected == 0
