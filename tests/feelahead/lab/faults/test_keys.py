"""The fault table's row on keys, with real processes: unknown or revoked, 0 messages, out within a second.

A revoked key is out at the next look at the keys, and others see on: tests/common/sockets/test_keys_on_the_wire.py.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from common.clock import MonotonicClock
from common.sockets.authentication import make_key_pair
from common.sockets.keys import KeyFolder
from feelahead.both_sides.processes import SideProcess
from robot_side.main import KEYS_PERIOD_S

pytestmark = pytest.mark.processes

START_S = 300.0
LIMIT_S = 600.0


@dataclass
class KeyedRobot:
    process: SideProcess
    folder: KeyFolder
    public: str
    listening: dict[str, Any]
    summary: Path

    def operator(self, folder: KeyFolder) -> SideProcess:
        return SideProcess(
            "operator_side",
            "operator",
            [
                f"--connect={self.listening['control']}",
                f"--view-connect={self.listening['view']}",
                f"--keys={folder.path}",
                f"--robot-key={self.public}",
                "--device=simulated",
            ],
        )

    def end(self) -> dict[str, Any]:
        """End it; return its figures."""
        assert self.process.stop(LIMIT_S) == 0
        content: dict[str, Any] = json.loads(self.summary.read_text())
        return content


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[KeyedRobot]:
    folder = made(tmp_path / "robot", "robot")
    summary = tmp_path / "robot.json"
    arguments = ["--bind=tcp://127.0.0.1:0", f"--keys={folder.path}", f"--summary={summary}"]
    with SideProcess("robot_side", "robot", arguments) as process:
        listening = process.wait_for("listening", START_S)
        yield KeyedRobot(process, folder, folder.public_path("robot").read_text().splitlines()[-1], listening, summary)


def made(path: Path, side: Any) -> KeyFolder:
    folder = KeyFolder(path)
    folder.write_pair(side, *make_key_pair())
    return folder


def public(folder: KeyFolder) -> str:
    return folder.public_path("operator").read_text().splitlines()[-1]


def wait_for_link(side: SideProcess, text: str) -> None:
    """Wait until the side's status says `text`."""
    clock = MonotonicClock()
    end_s = clock.now() + LIMIT_S
    link = None
    while clock.now() < end_s:
        link = side.wait_for("status", LIMIT_S)["link"]
        if text in link:
            return
    pytest.fail(f"the link is {link!r}; awaited: {text!r}")


def test_the_allow_list_is_looked_at_often_enough() -> None:
    assert KEYS_PERIOD_S <= 0.5


def test_an_allowed_operator_drives_and_a_revoked_one_is_thrown_out(robot: KeyedRobot, tmp_path: Path) -> None:
    anna = made(tmp_path / "anna", "operator")
    robot.folder.allow("anna", public(anna))
    with robot.operator(anna) as operator:
        wait_for_link(operator, "up")
        robot.folder.revoke("anna")
        wait_for_link(operator, "feelahead keys allow NAME")
        operator.events()
        assert [operator.wait_for("status", LIMIT_S)["link"] == "up" for _ in range(5)] == [False] * 5
    figures = robot.end()
    assert figures["messages"]["motion_received"] > 0
    assert figures["strangers"]["refused"] > 0


def test_an_unknown_key_moves_nothing(robot: KeyedRobot, tmp_path: Path) -> None:
    stranger = made(tmp_path / "stranger", "operator")
    with robot.operator(stranger) as operator:
        wait_for_link(operator, f"feelahead keys allow NAME {public(stranger)}")
    figures = robot.end()
    assert figures["messages"]["motion_received"] == 0
    assert figures["messages"]["stiffness_sent"] == 0
    assert figures["strangers"]["refused"] > 0
