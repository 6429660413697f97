"""The door's companion as a real process: what passes, who is cut off, and what an end costs."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq

from common.peer_name import may_drive
from common.sockets.authentication import OperatorKeys, make_key_pair
from common.sockets.door.client import Door
from common.sockets.door.messages import DoorSettings, DriverSettings, Listening
from common.sockets.keys import KeyFolder
from common.sockets.operator import OperatorSockets
from common.sockets.tcp_figures import TcpFigures
from tests.helpers.hostile.raw_zmtp import RawConnection, frame, port_of
from tests.helpers.machines.waiting import wait_until
from tests.helpers.socket_talk import EPHEMERAL, PATIENT_S

pytestmark = pytest.mark.processes


class Opened:
    """Door that listens, and what it said to people."""

    def __init__(self, door: Door, notes: list[str], at: Listening) -> None:
        self.door, self.notes, self.at = door, notes, at

    @property
    def process_id(self) -> int:
        companion = self.door._companion
        assert companion is not None
        return companion.process_id

    def hears(self, operator: OperatorSockets, payload: bytes) -> bytes:
        """Send until `payload` has come through; return the sender's name."""

        def heard() -> bytes | None:
            operator.send(payload)
            operator.receive()
            self.door.wait(0.01)
            return next((peer for peer, message in self.door.receive() if message == payload), None)

        return wait_until("the message came through", heard)


@contextlib.contextmanager
def opened(settings: DoorSettings) -> Iterator[Opened]:
    notes: list[str] = []
    with Door(settings, notes.append) as door:
        door.ready()
        yield Opened(door, notes, door.listen())


@pytest.fixture
def door() -> Iterator[Opened]:
    with opened(DoorSettings(EPHEMERAL, EPHEMERAL)) as one:
        yield one


def connected(at: Listening, keys: OperatorKeys | None = None) -> OperatorSockets:
    return OperatorSockets(at.control, at.view, keys=keys, heartbeat_timeout_s=PATIENT_S)


def test_control_and_views_pass_both_ways_and_the_owner_has_figures(door: Opened) -> None:
    with connected(door.at) as operator:
        peer = door.hears(operator, b"forth")
        door.door.own(peer)

        def back() -> bool:
            door.door.send(peer, b"back")
            door.door.publish(b"telemetry", b"seen")
            door.door.update()
            operator.wait(0.01)
            control.extend(operator.receive())
            views.extend(operator.receive_view())
            return bool(control and views and door.door.tcp_figures(peer) != TcpFigures())

        control, views = list[bytes](), list[tuple[bytes, bytes]]()
        wait_until("both come back", back)
        assert set(control) == {b"back"}
        assert set(views) == {(b"telemetry", b"seen")}
        assert door.door.tcp_figures(b"another") == TcpFigures()


def test_a_door_that_is_killed_is_replaced_and_the_session_goes_on_under_the_same_name(door: Opened) -> None:
    with connected(door.at) as operator:
        peer = door.hears(operator, b"before")
        os.kill(door.process_id, signal.SIGKILL)
        wait_until("another one is started", lambda: not door.door.wait(0.01) and door.door.restarts)
        assert door.hears(operator, b"after") == peer
    assert "ended (SIGKILL); another one is started" in door.notes[0]


def test_one_that_stands_still_delays_the_end_by_no_more_than_two_limits(door: Opened) -> None:
    os.kill(door.process_id, signal.SIGSTOP)
    process_id = door.process_id
    door.door.close()  # Waits for the last figures, then for the end, then kills.
    with pytest.raises(ProcessLookupError):
        os.kill(process_id, 0)


def test_a_message_without_an_end_is_cut_off_by_the_kernels_count_of_bytes(door: Opened) -> None:
    endless = RawConnection.introduced(port_of(door.at.control))
    piece = frame(bytes(4000), more=True) * 250  # A megabyte, of which ZeroMQ shows us nothing.
    endless._socket.setblocking(False)

    def cut_off() -> bool:
        with contextlib.suppress(OSError):
            endless._socket.sendall(piece)
        door.door.wait(0.01)
        return door.door.counts().get("heavy", 0) == 1

    with connected(door.at) as operator, contextlib.closing(endless):
        wait_until("it is cut off", cut_off)
        door.hears(operator, b"forth")
    assert door.door.restarts == 0


def test_a_key_that_floods_is_not_let_in_for_a_while_and_others_are(tmp_path: Path) -> None:
    folder, (robot, secret) = KeyFolder(tmp_path), make_key_pair()
    folder.write_pair("robot", robot, secret)
    (anna, annas), (mallory, mallorys) = make_key_pair(), make_key_pair()
    folder.allow("anna", anna)
    folder.allow("mallory", mallory)
    with (
        opened(DoorSettings(EPHEMERAL, EPHEMERAL, keys=str(tmp_path))) as door,
        connected(door.at, OperatorKeys(annas, robot)) as honest,
        zmq.Context() as context,
        context.socket(zmq.DEALER) as flooding,
    ):
        flooding.setsockopt(zmq.LINGER, 0)
        flooding.setsockopt(zmq.SNDHWM, 0)  # Our own sockets wait where the door reads slowly; a flood does not.
        OperatorKeys(mallorys, robot).secure(flooding)
        flooding.connect(door.at.control)
        door.hears(honest, b"forth")

        def barred() -> bool:
            for _ in range(2000):
                flooding.send(b"x", zmq.NOBLOCK)
            door.door.wait(0.01)
            door.door.receive()
            return any("mallory sent too much" in note for note in door.notes)

        wait_until("mallory is barred", barred)
        door.hears(honest, b"still here")
    assert door.door.counts()["flooding"] > 0


def test_a_changed_role_and_a_revocation_reach_peers_that_are_connected(tmp_path: Path) -> None:
    """A driver's port has the same list of keys: it must not take the news of a revocation from the others."""
    folder, (robot, secret), (anna, annas) = KeyFolder(tmp_path), make_key_pair(), make_key_pair()
    folder.write_pair("robot", robot, secret)
    folder.allow("anna", anna)
    arm = {"--arm": DriverSettings(EPHEMERAL, "driver", 4096, 1e6)}
    with (
        opened(DoorSettings(EPHEMERAL, EPHEMERAL, arm, keys=str(tmp_path))) as door,
        connected(door.at, OperatorKeys(annas, robot)) as operator,
    ):
        assert may_drive(door.hears(operator, b"drive"))
        folder.allow("anna", anna, "observer")
        wait_until("she only observes", lambda: not may_drive(door.hears(operator, b"watch")))

        def views() -> int:
            for _ in range(20):
                door.door.publish(b"telemetry", b"seen")
                door.door.wait(0.01)
                operator.send(b"watch")
                operator.wait(0.0)
            return len(operator.receive_view())

        wait_until("views arrive", lambda: views() > 0)
        folder.revoke("anna")
        wait_until("no view arrives any more", lambda: views() == 0 and views() == 0)


def test_a_message_of_a_driver_that_nobody_reads_does_not_keep_the_door_from_opening() -> None:
    """Its port is read later, as the robot side searches for spheres and compiles first."""
    arm = {"--arm": DriverSettings(EPHEMERAL, "driver", 4096, 1e6)}
    with Door(DoorSettings(EPHEMERAL, EPHEMERAL, arm), print) as door, zmq.Context() as context:
        door.ready()
        with context.socket(zmq.DEALER) as driver:
            driver.setsockopt(zmq.LINGER, 0)
            driver.connect(door.drivers["--arm"].bind)
            driver.send(b"state")
            wait_until("the message waits", lambda: door.wait(0.05) and len(door.ports["--arm"].arrived) > 0)
            assert door.listen().control
            assert [payload for _, payload, _ in door.ports["--arm"].receive()] == [b"state"]


def test_a_subscription_to_what_there_is_not_takes_no_memory_and_ends_the_viewer(door: Opened) -> None:
    with zmq.Context() as context, context.socket(zmq.SUB) as viewer, connected(door.at) as operator:
        viewer.setsockopt(zmq.LINGER, 0)
        with viewer.get_monitor_socket(zmq.EVENT_DISCONNECTED) as monitor:
            viewer.connect(door.at.view)
            viewer.setsockopt(zmq.SUBSCRIBE, b"t" * 2000)
            wait_until("it is ended", lambda: monitor.poll(10))
            viewer.disable_monitor()
        door.hears(operator, b"forth")


def test_the_process_that_ticks_has_no_zeromq() -> None:
    code = (
        "import sys\nfrom robot_side.main import command\n"
        "command(['--bind=tcp://127.0.0.1:0', '--no-cameras', '--duration=0.1', '--status=none'])\n"
        "print([name for name in sys.modules if name.partition('.')[0] == 'zmq'])"
    )
    ended = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.splitlines()[-1] == "[]"
