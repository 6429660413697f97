"""Start of the robot side's process with a port that is in use."""

import json
import resource
import socket
from pathlib import Path

import pytest

from common.sockets.robot import RobotSockets
from tests.helpers.python_process import ended

pytestmark = pytest.mark.processes


LATE = """
import sys
from robot_side import main
from robot_side.tick.events import Listener
class Late(Listener):
    def on_tick(self, tick):
        from robot_side.overlap import sphere_sphere
        sphere_sphere((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0), 1.0)
main.command(sys.argv[1:], lambda parts: (parts, [Late()]))
"""
"""Robot side with a listener of others that uses a part of the library in every tick"""


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
        return port


@pytest.mark.parametrize("flag", ["--arm", "--objects", "--pictures"])
def test_a_driver_with_the_port_of_the_operators_is_named(flag: str) -> None:
    address = f"tcp://127.0.0.1:{free_port()}"
    code, _, complaint = ended("-m", "robot_side", f"--bind={address}", f"{flag}={address}")
    assert code == 2
    assert f": {flag}: cannot bind {address}: the port is in use" in complaint


def test_a_kernel_that_is_compiled_while_it_runs_is_named_once_and_counted(tmp_path: Path) -> None:
    summary = tmp_path / "out.json"
    options = "--bind=tcp://127.0.0.1:0", "--no-cameras", "--duration=1", f"--summary={summary}"
    code, said, complaint = ended("-c", LATE, *options)
    assert code == 0, complaint
    [line] = [line for line in said.splitlines() if "compiled only now" in line]
    assert "robot_side.overlap.kernels._sphere_loop" in line
    figures = json.loads(summary.read_text())
    assert (figures["compiled_late"], figures["errors"]) == (1, [])
    assert figures["ticks"] > 1


def test_a_port_takes_a_quarter_of_the_descriptors_that_the_process_may_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (256, 4096))
    with RobotSockets("tcp://127.0.0.1:*", "tcp://127.0.0.1:*") as robot:
        assert [gate.connections.limit for gate in robot._ports.gates] == [64, 64]
