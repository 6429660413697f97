import fcntl
import struct
from collections import Counter
from contextlib import ExitStack, closing
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.sockets import authentication
from common.sockets.descriptors import shut_down
from common.sockets.operator import OperatorSockets
from common.sockets.peers import Connection, Peers
from common.sockets.robot import RobotSockets
from common.sockets.round_robin import (
    CONNECTIONS,
    MOST_CONNECTIONS_EACH,
    Offered,
    RoundRobin,
    RoundRobinConnection,
    group_of,
    new_group,
    routing_id,
)
from common.sockets.shell import CONTROL_UNSENT_BYTES, VIEW_HIGH_WATER_MARK, VIEW_UNSENT_BYTES
from tests.helpers.hostile.raw_zmtp import RawConnection, message, port_of
from tests.helpers.socket_talk import PATIENT_S, ROUNDS, drain_all, greet, publish_until_seen

STIFFNESS = bytes(461)


@dataclass(eq=False)
class Fed(RoundRobinConnection):
    answer: Offered = Offered.TAKEN
    taken: int = 0

    def offered(self, payload: bytes) -> Offered:
        self.taken += self.answer is Offered.TAKEN and bool(payload)
        return self.answer


@given(answers=st.lists(st.sampled_from([Offered.TAKEN, Offered.FULL]), min_size=1, max_size=16))
def test_connections_take_turns_and_a_full_one_is_passed_over(answers: list[Offered]) -> None:
    round_robin: RoundRobin[Fed] = RoundRobin(Fed.offered)
    round_robin.connections.extend(Fed(answer=answer) for answer in answers)
    able = answers.count(Offered.TAKEN)
    assert [round_robin.send(b"newest", 1.0, everywhere=False) for _ in range(3 * (able or 1))] == [able > 0] * 3 * (
        able or 1
    )
    assert {way.taken for way in round_robin.connections if way.answer is Offered.TAKEN} <= {3}
    assert round_robin.send(b"stop", 1.0, everywhere=True) == (able > 0)
    assert sum(way.taken for way in round_robin.connections) == 4 * able


def test_a_full_connection_is_tried_again_soon() -> None:
    round_robin: RoundRobin[Fed] = RoundRobin(Fed.offered)
    round_robin.connections.append(only := Fed(answer=Offered.FULL))
    assert not round_robin.send(b"newest", 1.0, everywhere=False)
    only.answer = Offered.TAKEN
    assert not round_robin.send(b"newest", 1.0005, everywhere=False)
    assert round_robin.send(b"newest", 1.0015, everywhere=False)


def test_a_silent_connection_gets_a_copy_twice_a_second_and_returns_once_heard() -> None:
    """Neither end uses a silent connection. Without copies, one that works again would stay silent for ever."""
    round_robin: RoundRobin[Fed] = RoundRobin(Fed.offered)
    lively, silent = Fed(), Fed()
    round_robin.connections.extend((lively, silent))
    for millisecond in range(2000):
        round_robin.heard(lively, now_s := 10.0 + millisecond / 1e3)
        assert round_robin.send(b"newest", now_s, everywhere=False)
    assert (lively.taken, silent.taken) == (2000, 4)
    lively.answer = Offered.FULL
    assert not round_robin.send(b"newest", 12.6, everywhere=False), "whether it is there nobody knows"
    lively.answer = Offered.TAKEN
    round_robin.heard(silent, 13.0)
    round_robin.heard(lively, 13.0)
    assert all(round_robin.send(b"newest", 13.0, everywhere=False) for _ in range(10))
    assert silent.taken == 5 + 5


@given(name=st.binary(max_size=20))
def test_only_our_own_names_are_grouped(name: bytes) -> None:
    ours = len(name) == 17 and name[0] == 1 and name[16] < MOST_CONNECTIONS_EACH
    assert group_of(name) == (name[:16] if ours else name)
    group = new_group()
    assert {group_of(routing_id(group, index)) for index in range(MOST_CONNECTIONS_EACH)} == {group}


def test_peers_and_their_connections_are_bounded() -> None:
    def taken(_: Connection, __: bytes) -> Offered:
        return Offered.GONE

    peers = Peers(taken)
    for _ in range(300):
        group = new_group()
        for index in range(MOST_CONNECTIONS_EACH):
            newest = peers.connection(routing_id(group, index), "a key").peer
    assert len(peers.connections) == 1024
    assert len(peers._peers) == 1024 // MOST_CONNECTIONS_EACH
    assert len(newest.round_robin.connections) == MOST_CONNECTIONS_EACH
    assert not newest.round_robin.send(b"", 0.0, everywhere=True)
    assert peers.get(newest.name) is None, "all that are gone are forgotten"


@pytest.mark.parametrize("connections", [1, 4, 16])
def test_a_message_goes_over_one_connection_or_over_all(robot: RobotSockets, connections: int) -> None:
    with OperatorSockets(robot.control_endpoint, heartbeat_timeout_s=PATIENT_S, connections=connections) as operator:
        peer = greet(robot, operator)
        for everywhere, copies in ((False, 1), (True, connections)):
            assert operator.send(b"stop", everywhere=everywhere)
            drain_all(lambda: [payload for _, payload in robot.receive()], robot.wait, [b"stop"] * copies)
            assert robot.send(peer, b"state", everywhere=everywhere)
            drain_all(operator.receive, operator.wait, [b"state"] * copies)
        assert robot.dropped == 0


def test_a_connection_that_breaks_off_comes_back_to_the_same_peer(
    robot: RobotSockets, operator: OperatorSockets
) -> None:
    peer = greet(robot, operator)
    [*before] = [each.descriptor for each in robot._peers.connections.values()]
    for descriptor in before[:2]:
        shut_down(descriptor)
    for number in range(200):
        operator.send(b"%d" % number)
        robot.wait(0.01)
        assert {name for name, _ in robot.receive()} <= {peer}
        robot.send(peer, b"state")
        operator.wait(0.0)
        operator.receive()
    assert greet(robot, operator) == peer


def unsent_bytes(descriptor: int) -> int:
    """Return the number of bytes that the kernel holds for a connection and has not sent (SIOCOUTQNSD)."""
    return int(struct.unpack("i", fcntl.ioctl(descriptor, 0x894B, bytes(4)))[0])


def test_the_kernel_holds_little_for_the_operator_sides_connections_too(
    robot: RobotSockets, monkeypatch: pytest.MonkeyPatch
) -> None:
    held: list[int] = []
    monkeypatch.setattr(authentication, "hold_little", lambda _, unsent_bytes: held.append(unsent_bytes))
    with OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as operator:
        publish_until_seen(robot, operator, b"telemetry")
        greet(robot, operator)
        assert any(len(held) > CONNECTIONS for _ in range(ROUNDS) if operator.wait(0.01) or not operator.receive())
    assert sorted(held) == sorted([*[CONTROL_UNSENT_BYTES] * CONNECTIONS, VIEW_UNSENT_BYTES])


def test_little_waits_for_a_peer_that_stops_reading_and_others_lose_nothing(
    robot: RobotSockets, operator: OperatorSockets
) -> None:
    """For each connection only a few messages and kilobytes wait, however long the peer does not read."""
    owner = greet(robot, operator)
    group, receive_bytes = new_group(), 4096
    port = port_of(robot.control_endpoint)
    with ExitStack() as stack:
        for index in range(4):
            deaf = RawConnection.introduced(port, buffer_bytes=receive_bytes, name=routing_id(group, index))
            stack.enter_context(closing(deaf)).send(message(b"hello"))
        names = Counter[bytes]()
        while names.total() < 4:
            assert robot.wait(PATIENT_S)
            names.update(name for name, _ in robot.receive())
        [observer] = names
        taken = 0
        for number in range(2000):
            taken += robot.send(observer, STIFFNESS)
            assert robot.send(owner, b"%d" % number)
            drain_all(operator.receive, operator.wait, [b"%d" % number])
        assert taken + robot.dropped == 2000, "the owner lost nothing"
        for each in robot._peers.get(observer).round_robin.connections:  # type: ignore[union-attr]
            assert unsent_bytes(each.descriptor) <= 8 * 1024
        # The receiver's own buffer takes more than twice its size, as the kernel counts it.
        assert taken * len(STIFFNESS) <= 4 * (16 * 1024 + 4 * receive_bytes)


def test_a_viewer_that_stops_reading_keeps_few_old_pictures_and_others_miss_nothing(
    robot: RobotSockets, operator: OperatorSockets
) -> None:
    """Another viewer gets telemetry even if both cameras' pictures and the scene are published just before it."""
    rounds, picture = 100, bytes(100_000)
    tick = [(b"video", picture), (b"video", picture), (b"scene", b"scene"), (b"telemetry", b"state")]
    publish_until_seen(robot, operator, b"telemetry")
    with closing(RawConnection.introduced(port_of(robot.view_endpoint), b"SUB", buffer_bytes=4096)) as deaf:
        deaf.send(message(b"\x01video"))
        gate = robot._ports.gates[1]
        assert any(
            robot.wait(0.01) or len(gate.connections._numbers) == 2 for _ in range(ROUNDS) if not robot.receive()
        )
        operator.receive_view()
        for _ in range(rounds):
            robot.receive()
            for topic, payload in tick:
                robot.publish(topic, payload)
            seen: list[tuple[bytes, bytes]] = []
            while len(seen) < len(tick):
                assert operator.wait(PATIENT_S)
                seen += [told for told in operator.receive_view() if told[1] != b"probe"]
            assert seen == tick
        assert max(unsent_bytes(descriptor) for descriptor in gate.connections._numbers) <= 2 * VIEW_UNSENT_BYTES
        kept = len(deaf.read_all()) / len(picture)
    assert 1 < kept < VIEW_HIGH_WATER_MARK + 3, "the subscription was there, and next to nothing waited"
