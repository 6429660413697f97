"""`feelahead doctor --connect` names every fault on the path; tested with invented facts, and sockets on loopback."""

import contextlib
import errno
import json
import re
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from common.protocol.codec import PROTOCOL_VERSION, encode
from common.protocol.link_end import LinkEnd
from common.sockets.allow_list import AllowList
from common.sockets.authentication import OperatorKeys, RobotKeys, make_key_pair
from common.sockets.greeting import KNOCK
from common.sockets.keys import KeyFolder
from common.sockets.operator import OperatorSockets
from feelahead.commands.doctor import link, port
from feelahead.commands.doctor.port import Opening, PathError, RobotAddress, judge_port, judge_view
from feelahead.main import command
from tests.helpers.serving_robot import ServingRobot

# By invented facts


def greeting(mechanism: bytes) -> Opening:
    return Opening(said=KNOCK + mechanism.ljust(20, b"\0") + bytes(32))


PLAIN, CURVE = greeting(b"NULL"), greeting(b"CURVE")
WAY = RobotAddress.to("tcp://robot:5555")
WITH_KEYS = RobotAddress(WAY.control, WAY.view, OperatorKeys("ab" * 32, "cd" * 32))


@pytest.mark.parametrize(
    ("way", "opening", "wrong", "said", "remedy"),
    [
        (WAY, Opening(errno.ENETUNREACH), "route", "this machine is in no network", "ip route get robot"),
        (WAY, Opening(errno.EHOSTUNREACH), "route", "no machine has that address", "ip route get robot"),
        (WAY, Opening(errno.ECONNREFUSED), "closed port", "nothing listens there", "--bind tcp://0.0.0.0:5555"),
        (WAY, Opening(errno.ETIMEDOUT), "firewall", "robot:5555 gave no answer", "any to any port 5555,5556"),
        (WAY, Opening(said=b"SSH-2.0-x"), "something else", "b'SSH-2.0-x'", "ss -ltnp"),
        (WAY, Opening(), "something else", "says nothing", "kill -CONT"),
        (WAY, Opening(hung_up=True), "something else", "hangs up at once", "behind it"),
        (WAY, greeting(b"PLAIN"), "something else", "PLAIN", "ss -ltnp"),
        (WAY, CURVE, "keys", "asks for keys", "--robot-key KEY"),
        (WITH_KEYS, PLAIN, "keys", "runs without keys", "leave --keys out"),
    ],
)
def test_what_is_wrong_with_a_port(way: RobotAddress, opening: Opening, wrong: str, said: str, remedy: str) -> None:
    with pytest.raises(PathError, match=re.escape(said)) as raised:
        judge_port(way, way.control, opening)
    assert (raised.value.wrong, "\n" in str(raised.value)) == (wrong, False)
    assert remedy in raised.value.remedy
    with pytest.raises(PathError, match=re.escape(said.replace("5555", "5556"))) as raised:
        judge_view(way, opening)
    assert raised.value.wrong == "view port"
    assert "--view-connect" in raised.value.remedy
    assert ("5555,5556" in raised.value.remedy) is (wrong == "firewall")


def test_a_robot_side_is_as_it_should_be_and_a_closed_port_of_this_machine_has_another_remedy() -> None:
    judge_port(WAY, WAY.control, PLAIN)
    judge_view(WITH_KEYS, CURVE)
    with pytest.raises(PathError, match="--connect tcp://ROBOT:5555"):
        judge_port(WAY, WAY.control, Opening(errno.ECONNREFUSED), loopback=True)


# By sockets on loopback


LONG_S, SHORT_S = 60.0, 0.3
"""Time limits in seconds: for an event that will come, and for one that never comes"""


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the doctor's time limits, so that tests pass on a busy machine."""
    limits = ("_ANSWER_LIMIT_S", "_HANDSHAKE_LIMIT_S", "_LARGE_LIMIT_S", "_TELEMETRY_LIMIT_S", "_MEASURE_S")
    for name in limits:
        monkeypatch.setattr(link, name, LONG_S)
    for name in ("_CONNECT_LIMIT_S", "_GREETING_LIMIT_S"):
        monkeypatch.setattr(port, name, LONG_S)
    monkeypatch.setattr(link, "_ROUND_TRIPS", 3)


class Doctor:
    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def line(self, *arguments: str, code: int = 1) -> str:
        assert command(["doctor", "--no-path", *arguments]) == code
        [line] = self._capsys.readouterr().out.splitlines()
        return str(line)

    def of(self, robot: ServingRobot, *arguments: str, code: int = 1) -> str:
        return self.line("--connect", robot.control, "--view-connect", robot.view, *arguments, code=code)


@pytest.fixture
def doctor(capsys: pytest.CaptureFixture[str]) -> Doctor:
    return Doctor(capsys)


@contextlib.contextmanager
def listening(accept: bool = False) -> Iterator[str]:
    """Yield the address of a port that takes connections and sends nothing; with `accept` it hangs up at once."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def hang_up() -> None:
            with contextlib.suppress(OSError):
                while True:
                    server.accept()[0].close()

        if accept:
            threading.Thread(target=hang_up, daemon=True).start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)


@contextlib.contextmanager
def closed() -> Iterator[str]:
    """Yield the address of a port on which nobody listens; it is bound, so that no other process gets it."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield f"tcp://127.0.0.1:{taken.getsockname()[1]}"


@contextlib.contextmanager
def http_server() -> Iterator[str]:
    class Quiet(BaseHTTPRequestHandler):
        def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002  # its name
            pass

    with HTTPServer(("127.0.0.1", 0), Quiet) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"tcp://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.mark.parametrize(
    ("stranger", "limit_s", "said"),
    [
        (closed, LONG_S, "closed port: 127.0.0.1:"),
        (listening, SHORT_S, "takes connections and says nothing"),
        (lambda: listening(accept=True), LONG_S, "hangs up at once"),
        (http_server, LONG_S, "what listens there begins with b'<!DOCTYPE HTML"),
    ],
)
def test_a_stranger_at_the_port(
    doctor: Doctor,
    monkeypatch: pytest.MonkeyPatch,
    stranger: Callable[[], AbstractContextManager[str]],
    limit_s: float,
    said: str,
) -> None:
    monkeypatch.setattr(port, "_GREETING_LIMIT_S", limit_s)
    with stranger() as address:
        assert said in doctor.line("--connect", address)


def test_packets_that_are_too_long_for_the_way(doctor: Doctor, monkeypatch: pytest.MonkeyPatch) -> None:
    class Narrow(OperatorSockets):
        def send(self, payload: bytes, *, everywhere: bool = False) -> bool:
            self.stuck = getattr(self, "stuck", False) or len(payload) > 1280
            return self.stuck or super().send(payload, everywhere=everywhere)

    monkeypatch.setattr(link, "OperatorSockets", Narrow)
    monkeypatch.setattr(link, "_LARGE_LIMIT_S", SHORT_S)
    with ServingRobot() as robot:
        assert doctor.of(robot).startswith("large packets: small packets reach ")


def test_a_name_that_nobody_knows(doctor: Doctor) -> None:
    assert doctor.line("--connect", "tcp://robot.invalid:5555").startswith("name: --connect: 'robot.invalid'")
    line = doctor.line("--connect", "tcp://127.0.0.1:5555", "--view-connect", "tcp://view.invalid:5556")
    assert line.startswith("name: --view-connect: 'view.invalid'")


def test_all_is_well_and_nobody_was_let_in(doctor: Doctor) -> None:
    with ServingRobot() as robot:
        line = doctor.of(robot, code=0)
        pattern = rf"reached: protocol {PROTOCOL_VERSION}, round trip [\d.]+ ms \(best of 3\), the arm is free .*"
        assert re.fullmatch(pattern, line)
        assert robot.session.leases_granted == robot.session.refused == robot.session.motion_received == 0


def test_the_owner_of_the_arm_keeps_it(doctor: Doctor) -> None:
    with ServingRobot() as robot:
        owner = LinkEnd("operator", 2, "an operator's")
        now_s = robot._clock.now()
        robot.session.receive(b"owner", encode(owner.hello(now_s)), now_s)
        token = robot.session.lease.token
        assert "somebody has the arm (you would observe, as number 1 " in doctor.of(robot, code=0)
        assert robot.session.owner_peer == b"owner"
        assert (robot.session.lease.token, robot.session.leases_granted) == (token, 1)
        assert robot.session.lease.observers() == []


def test_one_object_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    with ServingRobot() as robot:
        assert command(["doctor", "--connect", robot.control, "--view-connect", robot.view, "--json", "--no-path"]) == 0
        told = json.loads(capsys.readouterr().out)
        assert (told["reached"], told["wrong"], told["arm"], told["waiting"]) == (True, None, "free", 0)
        assert (told["protocol"], told["round_trips"]) == (PROTOCOL_VERSION, 3)
        assert told["round_trip_ms"] > 0.0
    with ServingRobot() as robot, closed() as view:
        assert command(["doctor", "--connect", robot.control, "--view-connect", view, "--json"]) == 1
        told = json.loads(capsys.readouterr().out)
        assert (told["reached"], told["wrong"], told["view_connect"]) == (False, "view port", view[6:])
        assert "refuses connections" in told["said"]
        assert told["remedy"].startswith("say --view-connect")


@pytest.mark.parametrize(
    ("robot", "never", "said"),
    [
        ({"answers": False, "publishes": False}, ("_ANSWER_LIMIT_S", "_HANDSHAKE_LIMIT_S"), "no answer: "),
        (
            {"version": PROTOCOL_VERSION + 1},
            (),
            f"version: the robot side speaks protocol version {PROTOCOL_VERSION + 1}, this machine",
        ),
        ({"publishes": False}, ("_TELEMETRY_LIMIT_S",), "view port: the control port works, but"),
    ],
)
def test_a_robot_side_that_is_silent_or_another(
    doctor: Doctor, monkeypatch: pytest.MonkeyPatch, robot: dict[str, Any], never: Sequence[str], said: str
) -> None:
    for name in never:
        monkeypatch.setattr(link, name, SHORT_S)
    with ServingRobot(**robot) as serving:
        assert doctor.of(serving).startswith(said)


def test_keys_on_both_sides_on_one_and_wrong_ones(doctor: Doctor, tmp_path: Path) -> None:
    folder = KeyFolder(tmp_path / "robot")
    (robot_key, secret), (operator_key, ours) = make_key_pair(), make_key_pair()
    KeyFolder(tmp_path / "operator").write_pair("operator", operator_key, ours)
    folder.allow("anna", operator_key)
    allowed = AllowList(folder)
    allowed.refresh()
    flags = ("--keys", str(tmp_path / "operator"), "--robot-key")
    with ServingRobot(keys=RobotKeys(secret, allowed)) as robot:
        assert doctor.of(robot, *flags, robot_key, code=0).startswith("reached: ")
        assert "asks for keys, and none were given" in doctor.of(robot)
        assert robot.sockets.refused == 0
        assert doctor.of(robot, *flags, make_key_pair()[0]).startswith("robot key: ")
        folder.revoke("anna")
        allowed.refresh()
        line = doctor.of(robot, *flags, robot_key)
        assert line.startswith("our key: ")
        assert line.endswith(f"feelahead keys allow NAME {operator_key}")
    with ServingRobot() as robot:
        assert "runs without keys, and --keys was given" in doctor.of(robot, *flags, robot_key)
