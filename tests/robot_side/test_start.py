"""Start of the robot side's process: with strangers who connect at once, and with a port that is in use."""

import contextlib
import json
import socket
import sys
import threading
from pathlib import Path

import pytest

from feelahead.both_sides.processes import SideProcess
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.python_process import ended

pytestmark = pytest.mark.processes
STRANGERS = 400
LATE = """
import sys
from robot_side import main
from robot_side.events import Listener
class Late(Listener):
    def on_tick(self, tick):
        from robot_side.overlap import sphere_sphere
        sphere_sphere((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0), 1.0)
main.command(sys.argv[1:], lambda parts: (parts, [Late()]))
"""
"""Robot side with a listener of others that uses a part of the library in every tick"""
FEW = """
import os, resource, sys
resource.setrlimit(resource.RLIMIT_NOFILE, (256, 256))
os.execv(sys.argv[1], sys.argv[1:])
"""


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
        return port


class Crowd(threading.Thread):
    """Thread that connects to a port as soon and as often as possible, and keeps the connections open."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.held: list[socket.socket] = []
        self.gone = threading.Event()
        self._port = port

    def run(self) -> None:
        while len(self.held) < STRANGERS and not self.gone.is_set():
            stranger = socket.socket()
            try:
                stranger.connect(("127.0.0.1", self._port))
            except OSError:
                stranger.close()
                self.gone.wait(1e-3)
            else:
                self.held.append(stranger)

    def leave(self) -> None:
        self.gone.set()
        self.join(LIMIT_S)
        for stranger in self.held:
            stranger.close()


def test_strangers_at_its_port_from_the_first_moment_do_not_end_it(tmp_path: Path) -> None:
    summary, port = tmp_path / "out.json", free_port()
    crowd = Crowd(port)
    crowd.start()
    flags = [f"--bind=tcp://127.0.0.1:{port}", f"--summary={summary}"]
    with (
        contextlib.ExitStack() as stack,
        SideProcess("robot_side", "robot", flags, before=[sys.executable, "-c", FEW]) as robot,
    ):
        stack.callback(crowd.leave)
        robot.wait_for("listening", LIMIT_S)
        crowd.join(LIMIT_S)
        assert len(crowd.held) == STRANGERS
        robot.events()
        for _ in range(5):
            robot.wait_for("status", LIMIT_S)
        assert robot.stop(LIMIT_S) == 0
    figures = json.loads(summary.read_text())
    assert figures["ticks"] > 0
    assert figures["strangers"]["crowded"] > 0


def test_a_port_that_is_taken_is_said_before_anything_is_made_ready() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        code, said, complaint = ended("-m", "robot_side", f"--bind=tcp://127.0.0.1:{port}")
    assert (code, said) == (2, "")
    assert f"--bind: cannot bind tcp://127.0.0.1:{port}: the port is in use" in complaint


@pytest.mark.parametrize("flag", ["--arm", "--objects"])
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
