"""Process feelahead-operator: a controller is plugged in and unplugged; the process hangs or is killed."""

import json
import os
import queue
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.clock import MonotonicClock
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, WARNING_LIGHT, Feel
from operator_side.dualsense.reports.output_report import parse_output_report
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.python_process import ended
from tests.helpers.repository import ROOT
from tests.operator_side.stiffness_source import StiffnessSource

pytestmark = pytest.mark.processes
REPORT_LENGTH = 48
ATTEMPTS = 20


class World:
    """Operator side's process, its controller as a FIFO, and a stand-in for the robot side."""

    def __init__(self, folder: Path, *flags: str, plugged_in: bool = True) -> None:
        self._folder = folder
        os.mkfifo(folder / "hidraw3")
        self._controller = os.open(folder / "hidraw3", os.O_RDWR | os.O_NONBLOCK)
        self.plug(plugged_in)
        self.source = StiffnessSource()
        self.source.state = "disarmed"
        self.source.__enter__()
        self.process = subprocess.Popen(
            [
                *(sys.executable, str(ROOT / "tests/helpers/plugged_operator.py"), str(folder)),
                *(f"--connect={self.source.control}", f"--view-connect={self.source.view}"),
                *("--status=json", *flags),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            start_new_session=True,
        )
        self.events: list[dict[str, Any]] = []
        self._lines: queue.Queue[str] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.written: list[Feel] = []

    def plug(self, plugged_in: bool) -> None:
        marker = self._folder / "plugged"
        if plugged_in:
            marker.touch()
        else:
            marker.unlink(missing_ok=True)

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait until `condition` is true, while the robot side sends stiffness."""
        self._until(condition, silent=False)

    def until_in_silence(self, condition: Callable[[], bool]) -> None:
        """Wait until `condition` is true, while the robot side sends no stiffness."""
        self._until(condition, silent=True)

    def _until(self, condition: Callable[[], bool], *, silent: bool) -> None:
        self.source.silent = silent
        clock = MonotonicClock()
        end_s = clock.now() + LIMIT_S
        while clock.now() < end_s:
            select.select([self._controller], [], [], 0.02)
            self._look()
            if condition():
                return
        raise AssertionError(f"not within {LIMIT_S} s; {self.events[-3:]}, {self.written[-3:]}")

    def notes(self) -> list[str]:
        return [event["text"] for event in self.events if event["event"] == "note"]

    def controller(self) -> str:
        shown = [event["controller"] for event in self.events if event["event"] == "status"]
        return shown[-1] if shown else "unknown"

    def stiffen(self) -> None:
        """Wait until the triggers are stiff."""
        self.until(lambda: self.controller() == "connected" and bool(self.source.payloads))
        self.source.state, self.source.r2 = "armed", 7
        self.until(self.is_stiff)

    def is_stiff(self) -> bool:
        """Return whether the last report that set R2 made it stiff."""
        commanded = [report.r2 for report in self.written if report.r2 is not None]
        return bool(commanded) and commanded[-1] != FREE_TRIGGER

    def hang(self) -> None:
        """Suspend the process while the triggers are stiff; retry if it released them just before."""
        for _ in range(ATTEMPTS):
            self.stiffen()
            self.process.send_signal(signal.SIGSTOP)
            os.waitpid(self.process.pid, os.WUNTRACED)
            self._look()
            if self.is_stiff():
                return
            self.process.send_signal(signal.SIGCONT)
        raise AssertionError(f"let go of by itself {ATTEMPTS} times; {self.written[-3:]}")

    def end(self) -> tuple[int, str]:
        """Wait until the process ends; return its exit code and standard error."""
        code = self.process.wait(LIMIT_S)
        self._reader.join(LIMIT_S)
        assert self.process.stderr is not None
        return code, self.process.stderr.read()

    def until_released(self) -> None:
        """Wait until the last write releases triggers and motors, while the robot side sends nothing."""
        self.until_in_silence(self.is_released)

    def is_released(self) -> bool:
        """Return whether the last write releases triggers and motors, whatever light it sets."""
        return bool(self.written) and replace(self.written[-1], light=None) == RELEASED

    def _look(self) -> None:
        while not self._lines.empty():
            self.events.append(json.loads(self._lines.get_nowait()))
        try:
            content = os.read(self._controller, 1 << 16)
        except BlockingIOError:
            return
        reports = [content[start : start + REPORT_LENGTH] for start in range(0, len(content), REPORT_LENGTH)]
        self.written += [parse_output_report(report) for report in reports]

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line)

    def __enter__(self) -> "World":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join(LIMIT_S)
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            stream.close()
        self.source.__exit__(None, None, None)
        os.close(self._controller)


def stiff(report: Feel) -> bool:
    return report.r2 not in (None, FREE_TRIGGER)


def tells_all(report: Feel) -> bool:
    """Return whether the report sets all parts and releases L2, as the first write or that merged with the next."""
    return report.l2 == FREE_TRIGGER and report.r2 is not None and report.rumble is not None


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    with World(tmp_path) as made:
        yield made


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_however_it_ends_the_triggers_are_released(world: World, number: signal.Signals) -> None:
    world.stiffen()
    world.process.send_signal(number)
    code, complaint = world.end()
    assert (code, complaint) == ((-9, "") if number is signal.SIGKILL else (0, ""))
    world.until_released()


def test_an_exception_releases_them_too(world: World, tmp_path: Path) -> None:
    world.stiffen()
    (tmp_path / "broken").touch()
    code, complaint = world.end()
    assert code == 1
    assert "as no driver should" in complaint
    (tmp_path / "broken").unlink()
    # The loop's last write fails with the driver, but the watchdog has opened the device by itself.
    world.until_released()


def test_they_are_released_when_the_robot_side_goes_silent(world: World) -> None:
    world.stiffen()
    world.until_in_silence(lambda: not world.is_stiff())
    world.until_in_silence(lambda: any(report.light == WARNING_LIGHT for report in world.written))
    assert world.process.poll() is None


def test_without_a_controller_it_says_so_and_commands_nothing_until_one_appears(tmp_path: Path) -> None:
    with World(tmp_path, plugged_in=False) as world:
        world.until(lambda: len(world.source.payloads) >= 5 and bool(world.notes()))
        [note] = world.notes()
        assert "no DualSense" in note
        assert "waiting for a controller" in note
        world.until(lambda: world.controller() == "absent")
        assert (world.source.commands, world.written) == (0, [])
        world.plug(True)
        world.until(lambda: world.source.commands > 10 and len(world.notes()) > 2 and len(world.written) > 0)
        assert world.notes()[1] == "controller: DualSense on USB (a4:5e:60:01:02:03)"
        assert "feelahead calibrate" in world.notes()[2]
        assert world.written[0] == RELEASED
        # On a machine that stalls, stiffness may expire, which only the light shows.
        assert {(report.l2, report.r2) for report in world.written[1:]} <= {(None, None)}


def test_hung_its_triggers_are_released_and_told_anew_when_it_runs_on(world: World) -> None:
    world.hang()
    world.until_released()
    written = len(world.written)
    world.process.send_signal(signal.SIGCONT)
    world.until(lambda: any(map(tells_all, world.written[written:])) and world.is_stiff())
    assert world.process.poll() is None


def test_released_while_a_write_does_not_return_and_told_anew_when_it_does(world: World, tmp_path: Path) -> None:
    world.stiffen()
    (tmp_path / "hangs").touch()
    world.source.r2 = 8  # Content of the next write.
    world.until(world.is_released)
    world.until(lambda: any("a write hangs" in note for note in world.notes()))
    written = len(world.written)
    (tmp_path / "hangs").unlink()
    world.until(lambda: any(map(tells_all, world.written[written:])) and world.is_stiff())
    assert world.process.poll() is None


def test_a_watchdog_that_ends_before_us_is_told_of_once_and_replaced(world: World) -> None:
    world.until(lambda: world.controller() == "connected")
    [watchdog] = Path(f"/proc/{world.process.pid}/task/{world.process.pid}/children").read_text().split()
    os.kill(int(watchdog), signal.SIGKILL)
    world.until(lambda: any("would release the triggers has ended" in note for note in world.notes()))
    seen = len(world.events)
    world.until(lambda: len(world.events) > seen + 5)
    assert sum("would release the triggers" in note for note in world.notes()) == 1
    world.stiffen()
    world.process.send_signal(signal.SIGKILL)
    assert world.end() == (-9, "")
    world.until_released()


def test_only_reading_starts_no_watchdog_and_writes_nothing(tmp_path: Path) -> None:
    with World(tmp_path, "--no-haptics") as world:
        world.until(lambda: world.controller() == "connected" and bool(world.source.payloads))
        children = Path(f"/proc/{world.process.pid}/task/{world.process.pid}/children").read_text()
        assert children == ""
        world.source.state, world.source.r2 = "armed", 7
        world.until(lambda: world.source.commands > 50)
        world.process.send_signal(signal.SIGKILL)
        assert world.end() == (-9, "")
        assert world.written == []


WITHOUT_HIDAPI = """
import sys
sys.modules["hidraw"] = None
sys.argv = ["feelahead-operator", "--status=none"]
from operator_side.__main__ import main
main()
"""


def test_without_hidapi_it_ends_at_once_and_says_how_to_get_it() -> None:
    code, _, complaint = ended("-c", WITHOUT_HIDAPI)
    assert code == 2
    [line] = complaint.splitlines()
    assert line.startswith("feelahead-operator: hidapi cannot be imported")
    assert "pip install --force-reinstall hidapi" in line
