import errno
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import zmq

from common.clock import MonotonicClock
from common.sockets.allow_list import AllowList
from common.sockets.authentication import (
    MOST_HANDSHAKES,
    Authenticator,
    OperatorKeys,
    RobotKeys,
    make_key_pair,
    public_part,
)
from common.sockets.keys import KeyFolder
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.socket_talk import EPHEMERAL, PATIENT_S


def refresh(sockets: RobotSockets) -> None:
    """Read the allow-list again and cut off revoked keys, as the door does."""
    assert sockets._keys is not None
    sockets.cut_off_keys(sockets._keys.allowed.refresh())


@dataclass
class Robot:
    folder: KeyFolder
    public: str
    sockets: RobotSockets

    def operator(self, name: str, *, allowed: bool = True) -> OperatorSockets:
        public, secret = make_key_pair()
        if allowed:
            self.folder.allow(name, public)
            refresh(self.sockets)
        return self.connect(OperatorKeys(secret, self.public))

    def connect(self, keys: OperatorKeys | None) -> OperatorSockets:
        return OperatorSockets(
            self.sockets.control_endpoint, self.sockets.view_endpoint, keys=keys, heartbeat_timeout_s=PATIENT_S
        )


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    folder = KeyFolder(tmp_path)
    public, secret = make_key_pair()
    keys = RobotKeys(secret, AllowList(folder))
    with RobotSockets(EPHEMERAL, keys=keys, heartbeat_timeout_s=PATIENT_S) as sockets:
        yield Robot(folder, public, sockets)


@dataclass
class Seen:
    """Messages that arrived within some time: at the robot side, and at the operator side by control and view."""

    at_robot: list[tuple[bytes, bytes]]
    control: list[bytes]
    view: list[tuple[bytes, bytes]]


def exchange(robot: Robot, operator: OperatorSockets, limit_s: float, *, until_both: bool) -> Seen:
    """Send and receive at both ends for `limit_s`; with `until_both`, stop once all three kinds have arrived."""
    clock = MonotonicClock()
    end_s = clock.now() + limit_s
    seen = Seen([], [], [])
    while clock.now() < end_s and not (until_both and seen.at_robot and seen.control and seen.view):
        operator.send(b"motion")
        robot.sockets.wait(0.002)
        for peer, payload in robot.sockets.receive():
            seen.at_robot.append((peer, payload))
            robot.sockets.send(peer, b"stiffness")
        robot.sockets.publish(b"telemetry", b"state")
        operator.wait(0.002)
        seen.control += operator.receive()
        seen.view += operator.receive_view()
    return seen


def gets_in(robot: Robot, operator: OperatorSockets) -> bool:
    seen = exchange(robot, operator, LIMIT_S, until_both=True)
    return bool(seen.at_robot and seen.control and seen.view)


def stays_out(robot: Robot, operator: OperatorSockets, limit_s: float = 0.5) -> bool:
    return exchange(robot, operator, limit_s, until_both=False) == Seen([], [], [])


def stays_out_and_says(robot: Robot, operator: OperatorSockets, text: str) -> bool:
    """Wait until the operator side reports `text`; return False if a message arrives before."""
    clock = MonotonicClock()
    end_s = clock.now() + LIMIT_S
    while clock.now() < end_s and stays_out(robot, operator, 0.1):
        if text in str(operator.trouble):
            return True
    return False


def test_an_unknown_key_gets_nothing_and_both_sides_say_what_to_do(robot: Robot) -> None:
    public, secret = make_key_pair()
    with robot.connect(OperatorKeys(secret, robot.public)) as stranger:
        assert stays_out_and_says(robot, stranger, f"feelahead keys allow NAME {public}")
    assert robot.sockets.refused > 0
    [told] = robot.sockets.news()
    assert f"feelahead keys allow NAME {public} --folder {robot.folder.path}" in told
    assert robot.sockets.news() == []


def test_each_refused_key_is_told_once_and_of_a_flood_only_the_first(tmp_path: Path) -> None:
    with zmq.Context() as context, context.socket(zmq.REQ) as part:
        authenticator = Authenticator(context, AllowList(KeyFolder(tmp_path)))
        part.connect("inproc://zeromq.zap.01")

        def ask(number: int, mechanism: bytes = b"CURVE", domain: bytes = b"feelahead") -> int:
            part.send_multipart([b"1.0", b"1", domain, b"", b"", mechanism, bytes([number]) * 32])
            authenticator.serve()
            assert part.recv_multipart()[2] == b"400"
            return len(authenticator.news())

        asked = [ask(1, mechanism=b"PLAIN"), ask(1, domain=b"another"), ask(1), ask(1), *map(ask, range(100))]
        assert asked == [0, 0, 1, 0, 1, 0] + [1] * 62 + [0] * 36
        assert authenticator.refused == 104
        context.destroy(linger=0)


def test_a_key_that_shakes_hands_without_end_is_refused_until_the_next_window(tmp_path: Path) -> None:
    folder, key = KeyFolder(tmp_path), bytes([7]) * 32
    folder.allow("anna", key.hex())
    allowed = AllowList(folder)
    allowed.refresh()
    with zmq.Context() as context, context.socket(zmq.REQ) as part:
        authenticator = Authenticator(context, allowed)
        part.connect("inproc://zeromq.zap.01")

        def ask() -> bytes:
            part.send_multipart([b"1.0", b"1", b"feelahead", b"", b"", b"CURVE", key])
            authenticator.serve()
            return part.recv_multipart()[2]

        assert [ask() for _ in range(MOST_HANDSHAKES + 2)] == [b"200"] * MOST_HANDSHAKES + [b"400"] * 2
        assert authenticator.news() == []
        assert authenticator.begin_window() == {key.hex()}
        assert ask() == b"200"
        assert authenticator.begin_window() == set()
        context.destroy(linger=0)


def test_a_key_that_is_allowed_later_gets_in_without_a_restart(robot: Robot) -> None:
    public, secret = make_key_pair()
    with robot.connect(OperatorKeys(secret, robot.public)) as late:
        assert stays_out(robot, late)
        robot.folder.allow("late", public)
        refresh(robot.sockets)
        assert gets_in(robot, late)
        clock = MonotonicClock()
        end_s = clock.now() + LIMIT_S
        while late.trouble is not None and clock.now() < end_s:
            exchange(robot, late, 0.1, until_both=False)
        assert late.trouble is None


def test_a_port_that_hangs_up_is_not_taken_for_one_that_asks_for_keys() -> None:
    clock = MonotonicClock()
    end_s = clock.now() + LIMIT_S
    with socket.create_server(("127.0.0.1", 0)) as starting:
        starting.settimeout(LIMIT_S)
        place = f"tcp://127.0.0.1:{starting.getsockname()[1]}"
        with OperatorSockets(place, place, keys=None, heartbeat_timeout_s=PATIENT_S) as operator:
            while operator.trouble is None and clock.now() < end_s:
                starting.accept()[0].close()
                operator.wait(0.1)
                operator.receive()
            assert "still starting" in str(operator.trouble)


def test_without_a_key_or_with_a_wrong_robot_key_nothing_comes_and_the_flag_is_named(robot: Robot) -> None:
    public, secret = make_key_pair()
    robot.folder.allow("anna", public)
    refresh(robot.sockets)
    for keys, flag in ((None, "--keys"), (OperatorKeys(secret, public_part("01" * 32)), "--robot-key")):
        with robot.connect(keys) as stranger:
            assert stays_out_and_says(robot, stranger, flag)


def test_a_robot_without_keys_is_not_trusted(tmp_path: Path) -> None:
    with RobotSockets(EPHEMERAL) as sockets:
        bare = Robot(KeyFolder(tmp_path), "ab" * 32, sockets)
        with bare.connect(OperatorKeys(make_key_pair()[1], make_key_pair()[0])) as operator:
            assert stays_out_and_says(bare, operator, "has no keys")
        with bare.connect(None) as operator:
            assert gets_in(bare, operator)


def test_a_revoked_key_is_cut_off_from_control_and_view_and_others_see_on(robot: Robot) -> None:
    with robot.operator("anna") as anna, robot.operator("ben") as ben:
        # Only anna has sent so far, so that the first peer is hers.
        anna_peer = exchange(robot, anna, LIMIT_S, until_both=True).at_robot[0][0]
        assert gets_in(robot, ben)
        robot.folder.revoke("anna")
        refresh(robot.sockets)
        # Messages sent before the revocation may still be in her own buffers.
        anna.receive(), anna.receive_view()
        clock = MonotonicClock()
        end_s = clock.now() + LIMIT_S
        ben_sees = False
        after = []
        while clock.now() < end_s and not (ben_sees and "feelahead keys allow" in str(anna.trouble)):
            refresh(robot.sockets)
            after += [peer for peer, _ in exchange(robot, anna, 0.01, until_both=False).at_robot]
            assert not robot.sockets.send(anna_peer, b"stiffness")
            ben.wait(0.0)
            ben_sees |= bool(ben.receive_view())
        assert anna_peer not in after
        assert stays_out(robot, anna, 0.3)
        assert ben_sees
        assert gets_in(robot, ben)
        assert "feelahead keys allow" in str(anna.trouble)


def test_a_view_that_cannot_be_reopened_is_tried_again(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    def short(*_: object) -> None:
        raise zmq.ZMQError(errno.EMFILE)

    with robot.operator("anna") as anna, robot.operator("ben") as ben:
        assert gets_in(robot, anna)
        assert gets_in(robot, ben)
        robot.folder.revoke("anna")
        with monkeypatch.context() as patch:
            patch.setattr(robot.sockets, "_open_view", short)
            refresh(robot.sockets)
            refresh(robot.sockets)
            robot.sockets.publish(b"telemetry", b"state")
        refresh(robot.sockets)
        assert gets_in(robot, ben)
        exchange(robot, anna, 0.1, until_both=False)  # Messages under way.
        assert stays_out(robot, anna)


def test_a_broken_allow_list_lets_nobody_stay(robot: Robot) -> None:
    with robot.operator("anna") as anna:
        assert gets_in(robot, anna)
        assert anna.send(b"motion")
        assert robot.sockets.wait(PATIENT_S)
        robot.folder.allowed_path.chmod(0o777)
        refresh(robot.sockets)
        assert robot.sockets.receive() == []
        assert robot.sockets.revoked > robot.sockets.flooding == 0
        exchange(robot, anna, 0.05, until_both=False)
        assert exchange(robot, anna, 0.2, until_both=False).at_robot == []
        assert any("nobody is let in any more" in text and "chmod 700" in text for text in robot.sockets.news())
        assert robot.sockets.news() == []
