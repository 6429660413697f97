"""Process feelahead-operator with a console: its address, its end, and a run that continues without it."""

import os
import signal
from pathlib import Path

import pytest

from feelahead.both_sides.processes import SideProcess
from tests.helpers.serving_robot import ServingRobot

pytestmark = pytest.mark.processes


def children(process_id: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{process_id}/task/{process_id}/children").read_text().split()]


def command(process_id: int) -> bytes:
    return Path(f"/proc/{process_id}/cmdline").read_bytes()


def test_a_run_outlives_its_console() -> None:
    with ServingRobot() as robot:
        arguments = [f"--connect={robot.control}", f"--view-connect={robot.view}", "--device=simulated", "--console"]
        with SideProcess("operator_side", "operator", arguments) as operator:
            assert str(operator.wait_for("console", 60.0)["address"]).startswith("http://127.0.0.1:")
            (console,) = (
                child for child in children(operator.process_id) if b"operator_side.viewing.console" in command(child)
            )
            os.kill(console, signal.SIGKILL)
            while "console has ended" not in str((note := operator.wait_for("note", 60.0))["text"]):
                pass
            assert note["text"] == "the console has ended; the run continues without it"
            operator.wait_for("status", 60.0)
            assert operator.stop() == 0
