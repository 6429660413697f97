"""The two real processes over loopback sockets: clean ends and crashes."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from common.errors import ConfigurationError
from common.sockets.authentication import make_key_pair
from common.sockets.keys import KeyFolder
from feelahead.both_sides.processes import SideFailedError, SideProcess
from robot_side.main import KEYS_PERIOD_S
from robot_side.operators.safety import SafetySettings

pytestmark = pytest.mark.processes

LIMIT_S = 600.0


def demo(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "feelahead.main", "demo", "--no-console", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_until(side: SideProcess, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Return the side's first status from now on for which `condition` holds."""
    side.events()
    for _ in range(5000):
        status = side.wait_for("status", LIMIT_S)
        if condition(status):
            return status
    return pytest.fail(f"the last status of the {side.name} side is {status}")


def wait_for_link(side: SideProcess) -> dict[str, Any]:
    return wait_until(side, lambda status: status.get("link") == "up")


def robot(*arguments: str) -> SideProcess:
    return SideProcess("robot_side.main", "robot", ["--bind=tcp://127.0.0.1:0", *arguments])


def operator(listening: dict[str, Any], *arguments: str) -> SideProcess:
    endpoints = [f"--connect={listening['control']}", f"--view-connect={listening['view']}"]
    return SideProcess("operator_side.main", "operator", [*endpoints, "--device=simulated", *arguments])


@pytest.mark.parametrize("more", [(), ("--compensation", "robot"), ("--law", "paper")], ids=["usual", "robot", "paper"])
def test_the_demo_runs_both_sides_and_writes_one_summary(tmp_path: Path, more: tuple[str, ...]) -> None:
    path = tmp_path / "out.json"
    with demo("--duration", "4", "--link", "delay 20ms", "--summary", str(path), *more) as process:
        _, complaint = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, complaint
    summary = json.loads(path.read_text())
    assert summary["errors"] == []
    assert summary["messages"]["stiffness_received"] > 0
    assert summary["messages"]["motion_received"] > 0
    for direction in ("to_robot", "to_operator"):
        # The emulated delay is a floor; how much a busy machine adds is for the benchmark to say.
        assert summary["delay_ms"][direction]["p50"] >= 20.0
    for key in (
        *("duration_s", "ticks", "tick_us", "tick_cpu_us", "skipped", "messages", "delay_ms", "applied_age_ms"),
        *("enlargement_mm", "overlap_mm3", "stiffness", "zones", "min_distance_mm", "contacts", "stops", "errors"),
    ):
        assert key in summary


def test_ctrl_c_ends_the_demo_cleanly(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    with demo("--duration", "60", "--status", "json", "--summary", str(path)) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if json.loads(line).get("link") == "up":
                break
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, complaint
    assert complaint == ""
    assert json.loads(path.read_text())["errors"] == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_each_side_ends_on_a_signal_with_its_triggers_released(tmp_path: Path, number: signal.Signals) -> None:
    path = tmp_path / "operator.json"
    with robot() as robot_side:
        with operator(robot_side.wait_for("listening", LIMIT_S), f"--summary={path}") as operator_side:
            wait_for_link(operator_side)
            os.kill(operator_side.process_id, number)
            assert operator_side.wait(LIMIT_S) == 0
        os.kill(robot_side.process_id, number)
        assert robot_side.wait(LIMIT_S) == 0
    assert json.loads(path.read_text())["triggers_released"] is True


def test_a_killed_operator_is_noticed_and_another_one_takes_over() -> None:
    with robot() as robot_side:
        listening = robot_side.wait_for("listening", LIMIT_S)
        with operator(listening) as first:
            wait_for_link(first)
            os.kill(first.process_id, signal.SIGKILL)
        with operator(listening) as second:
            assert wait_for_link(second)["state"] == "disarmed"
        robot_side.check()


@pytest.mark.parametrize("name", ["operator", "robot"])
def test_a_side_that_stood_still_disarms_and_what_was_held_back_is_discarded(tmp_path: Path, name: str) -> None:
    """SIGSTOP in full motion, then SIGCONT: armed again only after a healthy second, and by nothing that is old."""
    path = tmp_path / "robot.json"
    with robot(f"--summary={path}") as robot_side:
        with operator(robot_side.wait_for("listening", LIMIT_S)) as operator_side:
            wait_until(robot_side, lambda status: status["state"] == "armed" and (status["R2_pulled"] or 0.0) > 0.05)
            process = robot_side.process_id if name == "robot" else operator_side.process_id
            os.kill(process, signal.SIGSTOP)
            time.sleep(2.0)
            os.kill(process, signal.SIGCONT)
            resumed_s = time.monotonic()
            stopped = wait_until(robot_side, lambda status: status["state"] != "armed")
            assert str(stopped["stopped_because"]).startswith(("no command for", "nothing heard for the lease limit"))
            wait_until(robot_side, lambda status: status["state"] == "armed")
            assert time.monotonic() - resumed_s > SafetySettings().healthy_s
        assert robot_side.stop(LIMIT_S) == 0
    if name == "robot":  # by its age, or because its lease has ended meanwhile
        lease = json.loads(path.read_text())["lease"]
        assert lease["discarded_by_age"] + lease["commands_of_non_owners"] > 0


def test_an_unknown_key_moves_nothing_and_a_revoked_one_is_thrown_out(tmp_path: Path) -> None:
    assert KEYS_PERIOD_S <= 0.5  # out within a second
    folder, theirs, path = KeyFolder(tmp_path / "robot"), KeyFolder(tmp_path / "anna"), tmp_path / "robot.json"
    (robot_key, robot_secret), (anna_key, anna_secret) = make_key_pair(), make_key_pair()
    folder.write_pair("robot", robot_key, robot_secret)
    theirs.write_pair("operator", anna_key, anna_secret)
    moved: list[int] = []
    for allowed in (False, True):
        with robot(f"--keys={folder.path}", f"--summary={path}") as robot_side:
            listening = robot_side.wait_for("listening", LIMIT_S)
            with operator(listening, f"--keys={theirs.path}", f"--robot-key={robot_key}") as operator_side:
                if allowed:
                    wait_for_link(operator_side)
                    folder.revoke("anna")
                wait_until(operator_side, lambda status: f"feelahead keys allow NAME {anna_key}" in status["link"])
                assert [operator_side.wait_for("status", LIMIT_S)["link"] == "up" for _ in range(5)] == [False] * 5
            assert robot_side.stop(LIMIT_S) == 0
        figures = json.loads(path.read_text())
        assert figures["strangers"]["refused"] > 0
        moved.append(figures["messages"]["motion_received"])
        folder.allow("anna", anna_key)
    assert moved[0] == 0 < moved[1]


def test_a_killed_robot_side_is_an_error_of_the_demo() -> None:
    with demo("--duration", "60", "--status", "json") as process:
        assert process.stdout is not None
        robot_id = None
        for line in process.stdout:
            event = json.loads(line)
            if event["event"] == "started" and event["side"] == "robot":
                robot_id = event["process_id"]
            if event.get("link") == "up":
                break
        assert robot_id is not None
        os.kill(robot_id, signal.SIGKILL)
        _, complaint = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 1
    assert "Traceback" not in complaint


# Ends at a signal as the interpreter itself does before any of our handlers stands.
UNPREPARED = [sys.executable, "-c", "import signal; signal.signal(signal.SIGINT, signal.SIG_DFL); signal.pause()"]


def test_our_own_interrupt_of_a_side_that_has_not_begun_is_no_failure() -> None:
    with SideProcess("robot_side", "robot", [], before=UNPREPARED) as side:
        assert side.stop() != 0
        side.check()


def test_anothers_interrupt_is_one() -> None:
    with SideProcess("robot_side", "robot", [], before=UNPREPARED) as side:
        os.kill(side.process_id, signal.SIGKILL)
        side.wait(LIMIT_S)
        with pytest.raises(SideFailedError, match="code -9"):
            side.check()


def test_a_side_that_fails_says_why() -> None:
    with (
        SideProcess("robot_side.main", "robot", ["--probability=2"]) as side,
        pytest.raises(ConfigurationError, match="probability"),
    ):
        side.wait_for("listening", LIMIT_S)
