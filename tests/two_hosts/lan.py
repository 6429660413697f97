"""Two hosts on one cable, and the sides that run on them. Each host has its own home folder, clock and host names."""

import contextlib
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from common.status.codes import Doing
from feelahead.both_sides.processes import SideProcess
from robot_side.compiled.machine_code import machine_code_folder
from tests.helpers.machines.two_machines import Machine
from tests.helpers.machines.waiting import LIMIT_S, wait_until
from tests.helpers.repository import ROOT

NAME = "robot.lan"
"""Host name by which the operator's host finds the robot's"""
_CLOCK_AHEAD_S = 100_000
_MODULES = {"feelahead-robot": "robot_side", "feelahead-operator": "operator_side"}

Status = dict[str, Any]


@dataclass(frozen=True)
class Host:
    machine: Machine
    home: Path
    clock: tuple[str, ...] = ()
    """Command prefix by which programs of this account get a separate monotonic clock; empty: the machine's"""

    def surroundings(self) -> list[str]:
        """Return the command prefix that runs a program on this machine, as this user."""
        self.home.mkdir(exist_ok=True)
        folders = {f"XDG_{kind}_HOME": f"{self.home}/{place}" for kind, place in _FOLDERS}
        variables = {
            "HOME": str(self.home),
            "PATH": f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}",
            "PYTHONPATH": str(ROOT),
            "NUMBA_CACHE_DIR": str(machine_code_folder()),  # Each would compile.
        }
        given = folders | variables
        return [*self.machine.surroundings, *self.clock, "env", *(f"{name}={value}" for name, value in given.items())]

    def user(self, name: str) -> "Host":
        return replace(self, home=self.home.with_name(f"{self.home.name}-{name}"))

    def run(self, command: str, *, codes: tuple[int, ...] = (0,)) -> str:
        """Run a shell command as this user, and return its output; AssertionError for an exit code not in `codes`."""
        done = subprocess.run(
            [*self.surroundings(), "sh", "-c", command],
            capture_output=True,
            text=True,
            check=False,
            cwd=self.home,
            timeout=LIMIT_S,
        )
        assert done.returncode in codes, f"{command}: code {done.returncode}: {done.stderr.strip()[-300:]}"
        return done.stdout


_FOLDERS = (("CONFIG", ".config"), ("CACHE", ".cache"), ("DATA", ".local/share"), ("STATE", ".local/state"))

_SCENES = 4
_NO_FURTHER_S = 120.0
"""Time after which the scripted person counts as coming no further, in seconds: a task takes 20 s"""


class Side:
    def __init__(self, command: str, host: Host, more: tuple[str, ...] = ()) -> None:
        """command: line of the guide that starts a side. more: additional arguments of the test."""
        program, *arguments = shlex.split(command.replace("~/", f"{host.home}/"))
        self.name = program.removeprefix("feelahead-")
        self.process = SideProcess(_MODULES[program], self.name, [*arguments, *more], host.surroundings())
        self.said: list[Status] = []
        """All statuses, newest last"""
        self.notes: list[str] = []

    @property
    def status(self) -> Status:
        return self.said[-1] if self.said else {}

    def listen(self) -> None:
        """Read the side's new events; SideFailedError if the side has failed."""
        for event in self.process.events():
            if event["event"] == "status":
                self.said.append(event)
            elif event["event"] == "note":
                self.notes.append(event["text"])
        self.process.check()


class Lan:
    """Both hosts, and the sides that run now, started by the guide's commands."""

    def __init__(self, robot: Machine, operator: Machine, folder: Path) -> None:
        clock = ("unshare", "--time", "--monotonic", str(_CLOCK_AHEAD_S), "--boottime", str(_CLOCK_AHEAD_S))
        self.own_clocks = shutil.which("unshare") is not None and (
            subprocess.run([*clock, "true"], capture_output=True, check=False).returncode == 0
        )
        self.robot_host = Host(robot, folder / "robot", clock if self.own_clocks else ())
        self.operator_host = Host(operator, folder / "operator")
        self.starts: dict[str, str] = {}
        """Command line of the guide that starts each side, by the side's name"""
        self.doctor: str | None = None
        """Command line of the guide that checks the path to the robot side"""
        self.words: dict[str, str] = {"ROBOT": NAME}
        """Values of the guide's placeholders, which are words in capitals"""
        self._addresses = (robot.address, operator.address)
        self._sides: dict[str, Side] = {}
        self.mended = 0
        """Number of tests that had failed by the last `mend`"""
        operator.own_files.mkdir(parents=True)
        self.tell_name(robot.address)

    def tell_name(self, address: str) -> None:
        """Set the address that the operator's host has for the robot's name."""
        # In place: the running programs have this very file as /etc/hosts.
        with (self.operator_host.machine.own_files / "hosts").open("w", encoding="ascii") as hosts:
            hosts.write(f"127.0.0.1 localhost\n{address} {NAME}\n")

    def ask_doctor(self, code: int, words: str) -> None:
        assert self.doctor is not None
        assert words in self.operator_host.run(self.doctor, codes=(code,))

    # Sides

    @property
    def robot(self) -> Side:
        return self._sides["robot"]

    @property
    def operator(self) -> Side:
        return self._sides["operator"]

    def start(self, name: str, host: Host | None = None, *more: str, called: str | None = None) -> Side:
        """Start the side `name` by the guide's command. called: name of a second operator side."""
        ours = self.robot_host if name == "robot" else self.operator_host
        flags = () if name == "robot" else ("--device=simulated",)
        side = Side(self.starts[name], host or ours, (*flags, *more))
        self._sides[called or name] = side
        return side

    def end(self, called: str) -> None:
        """End a side as Ctrl-C does; AssertionError unless its exit code is 0."""
        with self._sides.pop(called).process as process:
            code = process.stop(LIMIT_S)
        assert code == 0, f"the {called} side ended with code {code}"

    def kill(self, called: str) -> None:
        with self._sides.pop(called).process as process:
            os.kill(process.process_id, signal.SIGKILL)

    def restart(self) -> None:
        """End all sides, then start both again, with a new scene."""
        self.end_all()
        self.start("robot")
        self.until("robot", "it listens", bool)
        self.start("operator")

    def end_all(self) -> None:
        with contextlib.ExitStack() as stack:
            for side in self._sides.values():
                stack.enter_context(side.process)
        self._sides.clear()

    def mend(self) -> None:
        """Restore the network after a failed test, and restart both sides."""
        for host, address in zip((self.robot_host, self.operator_host), self._addresses, strict=True):
            host.machine.plug_in()
            host.machine.set_link("mtu", "1500")
            host.machine.readdress(address)
        self.tell_name(self._addresses[0])
        self.swallow(False)
        self.restart()
        self.until("operator", "the link is up", lambda status: status["link"] == "up")

    def swallow(self, everything: bool) -> None:
        """True: let the robot's host drop all incoming packets without an answer; False: accept them again."""
        run = self.robot_host.run
        if everything:
            run("nft add table inet swallow")
            run("nft add chain inet swallow input '{ type filter hook input priority -10; policy drop; }'")
        else:
            run("nft delete table inet swallow", codes=(0, 1, 127))

    # Waiting

    def listen(self) -> None:
        for side in list(self._sides.values()):
            side.listen()

    def until(self, called: str, what: str, condition: Callable[[Status], bool], limit_s: float = LIMIT_S) -> Status:
        """Return the side's first status from now on for which `condition` holds; AssertionError after `limit_s`."""
        self.listen()
        side = self._sides[called]
        seen = len(side.said)

        def found() -> Status | None:
            nonlocal seen
            self.listen()
            fresh, seen = side.said[seen:], len(side.said)
            return next((status for status in fresh if condition(status)), None)

        return wait_until(f"{called}: {what}", found, limit_s, instead=lambda: _short(side.status))

    def watch(self, for_s: float) -> Iterator[None]:
        """Read events for `for_s`; yield after each reading, so that the caller can check."""
        end_s = time.monotonic() + for_s
        while time.monotonic() < end_s:
            time.sleep(0.1)
            self.listen()
            yield

    def moving(self) -> None:
        """Wait until the scripted person moves the arm."""
        self.while_driving("armed and moving", is_moving)

    def while_driving(self, what: str, condition: Callable[[Status], bool]) -> None:
        """Wait until `condition` holds for the operator side's status, while the scripted person does the task.

        A person who has finished, or comes no further as another one left the task half done, begins in a new scene.
        """
        for _ in range(_SCENES):
            try:
                status = self.until("operator", what, lambda one: is_done(one) or condition(one), _NO_FURTHER_S)
            except AssertionError as further:
                print(f"a new scene: {further}")
            else:
                if condition(status):
                    return
            self.restart()
        raise AssertionError(f"{what}: not in {_SCENES} scenes")

    def back(self) -> None:
        """Wait until the link is up again; assert that the arm is disarmed then; wait until it is armed again."""
        began_s = time.monotonic()
        status = wait_until("operator: the link is up", self._first_after_the_loss, LIMIT_S)
        print(f"back after {time.monotonic() - began_s:.1f} s")
        assert status["state"] == "disarmed"
        fresh = self.until("operator", "armed again", lambda status: is_done(status) or _is_armed_and_shown(status))
        if is_done(fresh):  # They were at the end of the task.
            self.moving()
        self.until("robot", "armed again", is_armed)

    def _first_after_the_loss(self) -> Status | None:
        """Return the operator side's first status with the link up again; None if there is none yet.

        It is found even if it is read late, when the arm may be armed again: that takes a second.
        """
        self.listen()
        said = self.operator.said
        lost = max((place for place, status in enumerate(said) if status["link"] != "up"), default=-1)
        return said[lost + 1] if said[lost + 1 :] else None


def is_armed(status: Status) -> bool:
    return bool(status["state"] == "armed")


def _is_armed_and_shown(status: Status) -> bool:
    return is_armed(status) and status["target_centre_mm"] is not None


def silence(stop: Status) -> str:
    """Return why the robot side stopped the arm; AssertionError unless it was because nothing came any more."""
    why = str(stop["stopped_because"])
    assert why.startswith(("no command for", "nothing heard for longer than")), why
    return why


def is_moving(status: Status) -> bool:
    return is_armed(status) and max(status["L2_pulled"] or 0.0, status["R2_pulled"] or 0.0) > 0.05


def is_done(status: Status) -> bool:
    return status.get("person") in (Doing.DONE, Doing.NO_TARGET)


def _short(status: Status) -> Status:
    return {name: status.get(name) for name in ("link", "link_reason", "state", "stopped_because", "feel", "person")}
