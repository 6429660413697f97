"""The two real processes over loopback sockets: clean ends and crashes."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from feelahead.both_sides.processes import SideFailedError, SideProcess

pytestmark = pytest.mark.processes

LIMIT_S = 600.0


def demo(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "feelahead.main", "demo", "--no-console", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_link(side: SideProcess) -> dict[str, Any]:
    for _ in range(5000):
        status = side.wait_for("status", LIMIT_S)
        if status.get("link") == "up":
            return status
    return pytest.fail("the link never came up")


def robot(*arguments: str) -> SideProcess:
    return SideProcess("robot_side.main", "robot", ["--bind=tcp://127.0.0.1:0", *arguments])


def operator(listening: dict[str, Any], *arguments: str) -> SideProcess:
    endpoints = [f"--connect={listening['control']}", f"--view-connect={listening['view']}"]
    return SideProcess("operator_side.main", "operator", [*endpoints, "--device=simulated", *arguments])


@pytest.mark.parametrize("more", [("--realtime",), ("--compensation", "robot"), ("--law", "paper")])
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
    for paced in (summary, summary["pacing"]["robot"], summary["pacing"]["operator"]):
        assert paced["overruns"] >= 0
        assert 0.0 <= paced["wake_error_us"]["p50"] <= paced["wake_error_us"]["p99"] <= paced["wake_error_us"]["max"]
    # Before the robot side knows its operator, a late tick reads no more of what waits than of anybody's.
    assert summary["strangers"].pop("unread") >= 0
    assert summary["strangers"] == {"refused": 0, "revoked": 0, "flooding": 0, "crowded": 0, "malformed": 0}
    # A deadline is met by a tick or counted as an overrun (test_pacing.py: each of them), and none is both.
    assert 0 < summary["ticks"] <= summary["ticks"] + summary["overruns"] <= summary["duration_s"] * 1000 + 1


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
