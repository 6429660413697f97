import os
import select
import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from common.protocol.codec import encode
from common.protocol.messages import MotionState
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel
from operator_side.dualsense.reports.output_report import parse_output_report
from tests.helpers.machines.waiting import LIMIT_S, wait_until
from tests.helpers.messages import uniform_update
from tests.helpers.python_process import start
from tests.helpers.serving_robot import ServingRobot

pytestmark = pytest.mark.processes
REPORT_LENGTH = 48


class StiffnessSource(ServingRobot):
    """Robot side that grants the lease, and sends it stiffness unless it is silent."""

    def __init__(self) -> None:
        super().__init__(publishes=False)
        self.state: MotionState = "disarmed"
        self.silent = False

    def tick(self, now_s: float) -> None:
        self.session.update(now_s)
        for owner in () if self.silent else self.session.owners(now_s):
            self.sockets.send(owner.peer, encode(uniform_update(owner.header, r2=7, state=self.state)))


class World:
    """Operator side's process, its controller as a FIFO, and a stand-in for the robot side."""

    def __init__(self, folder: Path) -> None:
        os.mkfifo(folder / "hidraw3")
        self._controller = os.open(folder / "hidraw3", os.O_RDWR | os.O_NONBLOCK)
        (folder / "plugged").touch()
        self.source = StiffnessSource()
        self.source.__enter__()
        ports = (f"--connect={self.source.control}", f"--view-connect={self.source.view}")
        self.process = start("tests/helpers/plugged_operator.py", str(folder), *ports, "--status=none")
        self.written: list[Feel] = []

    def until(self, what: str, condition: Callable[[], bool]) -> None:
        def looked() -> bool:
            select.select([self._controller], [], [], 0.02)
            self._look()
            return condition()

        wait_until(what, looked, instead=lambda: self.written[-3:])

    def stiffen(self) -> None:
        self.until("commands", lambda: bool(self.source.payloads and self.written))
        self.source.state = "armed"
        self.until("stiff", self.is_stiff)

    def is_stiff(self) -> bool:
        commanded = [report.r2 for report in self.written if report.r2 is not None]
        return bool(commanded) and commanded[-1] != FREE_TRIGGER

    def end(self) -> tuple[int, str]:
        _, complaint = self.process.communicate(timeout=LIMIT_S)
        return self.process.returncode, complaint

    def until_released(self) -> None:
        """Wait until the last write releases triggers and motors, whatever light it sets; nobody sends stiffness."""
        self.source.silent = True
        self.until("released", lambda: replace(self.written[-1], light=None) == RELEASED)

    def _look(self) -> None:
        try:
            content = os.read(self._controller, 1 << 16)
        except BlockingIOError:
            return
        reports = [content[at : at + REPORT_LENGTH] for at in range(0, len(content), REPORT_LENGTH)]
        self.written += [parse_output_report(report) for report in reports]

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()
        self.source.__exit__(None, None, None)
        os.close(self._controller)


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    made = World(tmp_path)
    yield made
    made.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_however_it_ends_the_triggers_are_released(world: World, number: signal.Signals) -> None:
    world.stiffen()
    world.process.send_signal(number)
    assert world.end() == ((-9, "") if number is signal.SIGKILL else (0, ""))
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
