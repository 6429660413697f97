"""A watched robot side and drivers, each in a separate process on this machine."""

import contextlib
import json
import os
import secrets
import signal
import socket
import tempfile
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from common.clock import MonotonicClock
from common.errors import FeelaheadError
from common.protocol.session import OWNING
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.summary import read_summary
from robot_side.operators.safety import SafetySettings

HEALTHY_S = 0.2
_START_S = 300.0
_PATIENCE_S = 300.0
"""Longer than anything takes, however busy the machine is."""
_CRUISE_S = 0.15
_ATTEMPTS = 20
_POLL_S = 0.005
RESTING_RAD_S = 0.01
_REVERSAL_S = 0.05
"""A deceleration so soon after a command was asked for by that command."""


class RigError(FeelaheadError):
    """Something awaited did not come; the text says what."""


class Rig:
    """One robot side, and as many drivers as are asked for; all of them end with the context."""

    def __init__(self, bind: str = "tcp://127.0.0.1:0", flags: Sequence[str] = (), before: Sequence[str] = ()) -> None:
        """`before` is a command in whose surroundings the robot side is to run."""
        self.clock = MonotonicClock()
        self._folder = tempfile.TemporaryDirectory(prefix="feelahead-faults-")
        self._log = Path(self._folder.name) / "log.jsonl"
        self._log.touch()
        self._reader = self._log.open(encoding="utf-8")
        self._rest = ""
        self._drivers: list[SideProcess] = []
        self._started = 0
        self.owned_s: dict[int, float] = {}
        """When each driver, by its process, learnt last that it owns the lease."""
        self._phases: dict[int, dict[str, Any]] = {}
        self._pause = threading.Event()
        self.stops: list[str] = []
        """Why the robot side disarmed, each time that the log was read past it."""
        self._summary = Path(self._folder.name) / "summary.json"
        own = [f"--log={self._log}", f"--summary={self._summary}"]
        arguments = [f"--bind={bind}", *own, f"--safety.healthy-s={HEALTHY_S}", *flags]
        self.robot = SideProcess("feelahead.lab.faults.watched_robot", "robot", arguments, before)
        try:
            self.listening = self.robot.wait_for("listening", _START_S)
        except BaseException:
            self.close()
            raise
        self.listening_s = self.clock.now()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End everything, also what a signal has stopped."""
        for process in (*self._drivers, self.robot):
            _end(process)
        self._reader.close()
        self._folder.cleanup()

    def end(self, driver: SideProcess) -> None:
        """End a driver and wait until its lease has ended, too."""
        driver.stop()
        deadline_s = self.clock.now() + 3.0
        while self.figures()["state"] == "armed" and self.clock.now() < deadline_s:
            self.wait(0.05)
        self.wait(SafetySettings().lease_s)

    def summary(self) -> dict[str, Any]:
        """End the robot side; return its summary."""
        self.robot.stop()
        return read_summary(self._summary)

    def rounds(self, count: int, limit_s: float) -> Iterator[None]:
        """Yield `count` times, or for as many rounds as begin within `limit_s`."""
        deadline_s = self.clock.now() + limit_s
        for _ in range(count):
            yield
            if self.clock.now() > deadline_s:
                return

    def wait(self, duration_s: float) -> None:
        """Let time pass."""
        self._pause.wait(duration_s)

    def driver(self, control: str | None = None, view: str | None = None, before: Sequence[str] = ()) -> SideProcess:
        """Start one more driver, connected to the robot side or to these addresses."""
        arguments = [
            f"--connect={control or self.listening['control']}",
            f"--view-connect={view or self.listening['view']}",
            f"--healthy-ms={1e3 * HEALTHY_S}",
        ]
        # Back and forth, or the arm would run into something in the end.
        self._started += 1
        if self._started % 2 == 0:
            arguments.append("--backward")
        process = SideProcess("feelahead.lab.faults.driver", "driver", arguments, before)
        self._drivers.append(process)
        return process

    def phase(self, driver: SideProcess) -> dict[str, Any]:
        """Return the newest words of the driver about its hands and its session."""
        for event in driver.events():
            if event["event"] == "driver":
                before = self._phases.get(driver.process_id, {}).get("session")
                if event["session"] in OWNING and before not in OWNING:
                    self.owned_s[driver.process_id] = event["time_s"]
                self._phases[driver.process_id] = event
        return self._phases.get(driver.process_id, {"phase": "start", "session": "none", "time_s": 0.0})

    def until(self, driver: SideProcess, what: str, *values: str, patience_s: float = _PATIENCE_S) -> dict[str, Any]:
        """Wait until the driver's `phase` or `session` is one of these; RigError when it takes too long."""
        deadline_s = self.clock.now() + patience_s
        while (said := self.phase(driver))[what] not in values:
            self.robot.check()
            if self.clock.now() > deadline_s:
                raise RigError(f"the driver's {what} is {said[what]!r} after {patience_s:g} s; expected: {values}")
            self.wait(_POLL_S)
        return said

    def drive(self, driver: SideProcess) -> bool:
        """Have it own, arm and drive, again when a busy machine breaks the stream; say whether the arm moves evenly."""
        self.until(driver, "session", *OWNING)
        for _ in range(_ATTEMPTS):
            self.signal(driver, signal.SIGUSR1)
            self.until(driver, "phase", "drive")
            self.wait(_CRUISE_S)
            if self.phase(driver)["phase"] == "drive":
                return True
        return False

    def signal(self, process: SideProcess, number: signal.Signals) -> None:
        """Send it a signal."""
        os.kill(process.process_id, number)

    def lines(self) -> list[dict[str, Any]]:
        """Read the lines that the robot side's log has got since the last call."""
        *whole, self._rest = (self._rest + self._reader.read()).split("\n")
        lines = [json.loads(line) for line in whole]
        self.stops += [line["why"] for line in lines if "stop" in line]
        return lines

    def until_line(self, key: str, patience_s: float = _PATIENCE_S) -> dict[str, Any]:
        """Wait for the next line of the log with this key; RigError when none comes."""
        deadline_s = self.clock.now() + patience_s
        while True:
            for line in self.lines():
                if key in line:
                    return line
            self.robot.check()
            if self.clock.now() > deadline_s:
                raise RigError(f"no {key} in the robot side's log within {patience_s:g} s")
            self.wait(_POLL_S)

    def figures(self) -> dict[str, Any]:
        """Wait for the robot side's counters of a moment from now on."""
        asked_s = self.clock.now()
        while (line := self.until_line("figures"))["time"] < asked_s:
            pass
        figures: dict[str, Any] = line["figures"]
        return figures

    def rest(self) -> dict[str, Any]:
        """Wait until the arm stands, disarmed; return the counters, the last ones when it never does."""
        deadline_s = self.clock.now() + _PATIENCE_S
        while not stands(figures := self.figures()) and self.clock.now() < deadline_s:
            pass
        return figures

    def stop_of(self, patience_s: float = 10.0) -> tuple[float | None, float | None]:
        """Return when the arm slowed down and the robot side disarmed, in seconds after the newest accepted command."""
        slowed_s = disarmed_s = None
        deadline_s = self.clock.now() + patience_s
        while (slowed_s is None or disarmed_s is None) and self.clock.now() < deadline_s:
            for line in self.lines():
                if line.get("deceleration") is not None and line["after"] > _REVERSAL_S:
                    slowed_s = line["after"]
                elif "stop" in line:
                    disarmed_s = line["after"]
            self.wait(_POLL_S)
        return slowed_s, disarmed_s


def stands(figures: dict[str, Any]) -> bool:
    """Say whether the robot is disarmed and at rest."""
    return bool(figures["state"] == "disarmed" and figures["speed_rad_s"] < RESTING_RAD_S)


def free_ports(count: int) -> list[int]:
    """Find ports for later: below those that Linux hands out by itself (32768 and up), lest another one gets them."""
    ports: list[int] = []
    for port in secrets.SystemRandom().sample(range(20_000, 30_000), 1000):
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            ports.append(port)
        if len(ports) == count:
            break
    return ports


def _end(process: SideProcess) -> None:
    if process.running:
        os.kill(process.process_id, signal.SIGCONT)
    process.__exit__(None, None, None)
