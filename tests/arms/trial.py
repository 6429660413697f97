"""A peer, its driver, the robot side and an operator as processes: each may be killed, stopped and replaced."""

import contextlib
import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from feelahead.both_sides.processes import SideProcess
from tests.arms.models import JOINTS, START_RAD
from tests.arms.positions import PositionLog, Positions
from tests.arms.provide import Peer, provided
from tests.helpers.machines.waiting import LIMIT_S, wait_until
from tests.helpers.repository import ROOT

DRIVERS: Final = ROOT / "docs" / "drivers"
PACING: Final = ("--person-file", str(Path(__file__).with_name("person.py")))
PULLING: Final = ("--pull-n", "2")
TOPIC: Final = {
    "positions": "/forward_position_controller/commands",
    "trajectory": "/joint_trajectory_controller/joint_trajectory",
}
MOVES_RAD: Final = 0.02
_MOVES_S: Final = 0.3
STARTS: Final = tuple(f"{name}={start}" for name, start in zip(JOINTS, START_RAD, strict=True))


@dataclass(frozen=True)
class Kind:
    """Peer and the arguments of its driver."""

    peer: Peer
    controls: str = "positions"
    """For ROS 2: what the controller takes, positions or a trajectory"""

    @property
    def name(self) -> str:
        return self.peer if self.peer == "franka" else f"{self.peer} {self.controls}"


class Program:
    """Process of a peer or driver, whose output goes to a file."""

    def __init__(self, command: Sequence[str], said: Path, environment: Mapping[str, str]) -> None:
        self.said = said
        with said.open("w") as out:
            self.process = subprocess.Popen(
                command, stdout=out, stderr=out, stdin=subprocess.PIPE, text=True, cwd=ROOT, env=environment
            )

    def hurry(self) -> "Program":
        """Give it a real-time priority, if that is permitted: a real arm does not share this machine's processors."""
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(self.process.pid, os.SCHED_RR, os.sched_param(1))
        return self

    def order(self, line: str) -> None:
        """Write a line to the program's standard input."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def send(self, what: signal.Signals) -> None:
        self.process.send_signal(what)

    def kill(self) -> None:
        """End the program as kill -9 does, and wait for its end."""
        self.process.kill()
        self.process.wait()
        if self.process.stdin is not None:
            self.process.stdin.close()

    def heard(self) -> str:
        return self.said.read_text(errors="replace")


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Trial:
    """Everything that runs, as a context. All starts are by `begin...`; the end of the context ends all."""

    def __init__(self, kind: Kind, folder: Path, model: Path | None, between_m: str = "") -> None:
        """folder: with the models, for logs. model: of the robot side; None: built-in. between_m: as for franka.py."""
        self.kind, self._folder, self._between_m = kind, folder, between_m
        self._python = str(provided(kind.peer))
        self._number = os.getpid() % 200 + 1
        self.address = f"tcp://127.0.0.1:{free_port()}"
        self.events: list[tuple[float, str, dict[str, Any]]] = []
        """Time of reading, side, and event"""
        self.peer: Program | None = None
        self.driver: Program | None = None
        self.operator: SideProcess | None = None
        self.robot: SideProcess | None = None
        self._robot_since_s = 0.0
        self._programs, self._model = 0, model
        self._log = PositionLog(folder / "positions.csv")
        self.summary = folder / "robot.json"

    def __enter__(self) -> Self:
        self.begin_robot()
        return self

    def begin_robot(self) -> None:
        """Start the robot side."""
        arguments = ["--bind=tcp://127.0.0.1:0", f"--arm={self.address}", "--no-cameras", f"--summary={self.summary}"]
        if self._model is not None:
            arguments += [f"--model={self._model}", "--site=pinch"]
        self._robot_since_s = time.monotonic()
        self.robot = SideProcess("robot_side", "robot", arguments)

    def kill_robot(self) -> None:
        """End the robot side as kill -9 does."""
        assert self.robot is not None
        os.kill(self.robot.process_id, signal.SIGKILL)
        self.robot.__exit__()
        self.robot = None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for side in (self.operator, self.robot):
            if side is not None:
                side.__exit__()
        for program in (self.driver, self.peer):
            if program is not None:
                program.send(signal.SIGCONT)
                program.kill()

    @property
    def _environment(self) -> dict[str, str]:
        ros = {"ROS_DOMAIN_ID": str(self._number % 100), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        more = {"FR3_MJCF": str(self._folder / "arm.xml"), "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
        return {**os.environ, **ros, **more}

    def program(self, *words: str) -> Program:
        """Start a program with the Python of the peer."""
        self._programs += 1
        return Program([self._python, *words], self._folder / f"program-{self._programs}.txt", self._environment)

    def begin_peer(self) -> None:
        """Start the peer once the robot side waits for it, and wait until it serves; its log begins anew."""
        self.wait_until("the robot side waits", lambda: any("waiting for an arm" in note for note in self.notes()))
        self._log.begin_anew()
        host = (f"127.0.0.{self._number}",) if self.kind.peer == "franka" else ()
        last = (self._between_m,) if host else STARTS
        self.peer = self.program("-m", f"tests.arms.peers.{self.kind.peer}", *host, str(self._log.path), *last).hurry()
        wait_until("the peer says where it is", lambda: len(self.positions().times_s) > 10)

    def begin_driver(self, joints: Sequence[str] = JOINTS) -> None:
        """Start the driver of docs/drivers."""
        script = str(DRIVERS / f"{self.kind.peer}_arm.py")
        if self.kind.peer == "franka":
            self.driver = self.program(script, f"127.0.0.{self._number}", self.address).hurry()
        else:
            words = (self.kind.controls, TOPIC[self.kind.controls], ",".join(joints), f"address={self.address}")
            limits = ("velocity_rad_s=2.0", "acceleration_rad_s2=12", "latency_s=0.05")
            self.driver = self.program(script, *words, *limits).hurry()

    def begin_operator(self, hands: Sequence[str]) -> None:
        """Start an operator side with these hands; one that runs ends before."""
        if self.operator is not None:
            self.operator.__exit__()
        self.wait_until("the robot side listens", lambda: self._listening)
        ports = [f"--connect={self._listening['control']}", f"--view-connect={self._listening['view']}"]
        self.operator = SideProcess("operator_side", "operator", [*ports, "--device=simulated", *hands])

    def look(self) -> None:
        """Read the sides' events."""
        now_s = time.monotonic()
        for side in (self.robot, self.operator):
            if side is not None:
                side.check()
                self.events += [(now_s, side.name, event) for event in side.events()]

    def wait_until(self, what: str, holds: Callable[[], object], limit_s: float = LIMIT_S) -> None:
        """Wait for an event; AssertionError names it and what the sides say instead."""

        def looked() -> bool:
            self.look()
            return bool(holds())

        wait_until(what, looked, limit_s, instead=self._instead)

    @property
    def _listening(self) -> dict[str, Any]:
        said = (event for at_s, _, event in self.events if at_s >= self._robot_since_s)
        return next((event for event in said if event["event"] == "listening"), {})

    def _instead(self) -> str:
        programs = [f"{one.said.name}: {one.heard()[-200:]}" for one in (self.peer, self.driver) if one is not None]
        return f"{self.status('operator').get('state')}; {self.notes()[-4:]}; {programs}"

    def watch(self, seconds: float) -> None:
        """Let time pass, and read the sides' events."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.look()
            time.sleep(0.02)

    def statuses(self, side: str, since_s: float = 0.0) -> list[dict[str, Any]]:
        """Return a side's statuses since a time."""
        return [
            event
            for at_s, name, event in self.events
            if at_s >= since_s and name == side and event["event"] == "status"
        ]

    def status(self, side: str) -> dict[str, Any]:
        """Return a side's newest status; empty before the first."""
        found = self.statuses(side)
        return found[-1] if found else {}

    def notes(self, since_s: float = 0.0) -> list[str]:
        """Return the robot side's notes since a time."""
        return [event["text"] for at_s, _, event in self.events if at_s >= since_s and event["event"] == "note"]

    def positions(self) -> Positions:
        """Return the peer's own positions until now."""
        return self._log.read()

    def moves(self) -> bool:
        """Return whether the peer's arm has moved within the last third of a second."""
        now_s = time.monotonic()
        return self.positions().between(now_s - _MOVES_S, now_s).moved_rad() > MOVES_RAD

    def fastest_rad_s(self) -> float:
        """Return the greatest velocity of a joint until now, over 0.1 s."""
        seen = self.positions()
        apart = max(round(0.1 / float(np.median(np.diff(seen.times_s)))), 1)
        ways = np.abs(seen.joints_rad[apart:] - seen.joints_rad[:-apart]).max(axis=1)
        return float((ways / (seen.times_s[apart:] - seen.times_s[:-apart])).max())

    def rests(self, for_s: float = 2.0) -> bool:
        """Return whether the peer's arm has moved before, and not for `for_s`."""
        now_s, seen = time.monotonic(), self.positions()
        return seen.moved_rad() > MOVES_RAD and seen.between(now_s - for_s, now_s).moved_rad() < 1e-3

    def drive(self, hands: Sequence[str] = PACING, limit_s: float = LIMIT_S) -> None:
        """Start a new operator, and wait until the arm is armed and moves."""
        self.begin_operator(hands)
        began_s = time.monotonic()

        def armed() -> bool:
            return any(one["state"] == "armed" for one in self.statuses("operator", began_s)[-1:])

        self.wait_until("armed and moving", lambda: armed() and self.moves(), limit_s)
