"""Both sides as two real processes: they end cleanly, and crashes and outside failures are reported in one line."""

import contextlib
import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

import operator_side.main
import robot_side.main
from common.loop.loop import Loop
from common.sockets.authentication import make_key_pair
from common.sockets.door.keeper import KEYS_S
from common.sockets.keys import KeyFolder
from feelahead.both_sides.processes import SideFailedError, SideProcess
from operator_side.turns import OperatorTurns
from robot_side.operators.safety import SafetySettings
from robot_side.turns import RobotTurns
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.machines.waiting import wait_until as wait_for
from tests.helpers.python_process import ended, start
from tests.helpers.serving_robot import ServingRobot

pytestmark = pytest.mark.processes
DEMO = ("-P", "-m", "feelahead", "demo", "--no-console")


def wait_until(side: SideProcess, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Wait for the side's first unread status for which `condition` holds, and return it."""
    for _ in range(5000):
        status = side.wait_for("status", LIMIT_S)
        if condition(status):
            return status
    return pytest.fail(f"the last status of the {side.name} side is {status}")


def wait_for_link(side: SideProcess) -> dict[str, Any]:
    return wait_until(side, lambda status: status.get("link") == "up")


def robot(*arguments: str) -> SideProcess:
    return SideProcess("robot_side", "robot", ["--bind=tcp://127.0.0.1:0", *arguments])


def operator(listening: dict[str, Any], *arguments: str) -> SideProcess:
    endpoints = [f"--connect={listening['control']}", f"--view-connect={listening['view']}"]
    return SideProcess("operator_side", "operator", [*endpoints, "--device=simulated", *arguments])


def test_the_demo_runs_both_sides_and_writes_one_summary(tmp_path: Path) -> None:
    path, more = tmp_path / "out.json", ("--realtime", "--compensation", "robot")
    code, _, complaint = ended(*DEMO, "--duration", "3", "--link", "delay 20ms", "--summary", str(path), *more)
    assert code == 0, complaint
    summary = json.loads(path.read_text())
    assert summary["errors"] == []
    assert summary["messages"]["stiffness_received"] > 0
    assert summary["messages"]["motion_received"] > 0
    assert (summary["compiled_late"], summary["loaded_late"]) == (0, {"robot": [], "operator": []})
    for direction in ("to_robot", "to_operator"):
        # The emulated delay is a floor; a busy machine's excess is for the benchmark.
        assert summary["delay_ms"][direction]["p50"] >= 20.0
    for key in (
        *("duration_s", "ticks", "tick_us", "tick_cpu_us", "skipped", "work", "messages", "delay_ms", "applied_age_ms"),
        *("enlargement_mm", "overlap_mm3", "stiffness", "zones", "min_distance_mm", "contacts", "stops", "errors"),
    ):
        assert key in summary
    for paced in (summary, summary["pacing"]["robot"], summary["pacing"]["operator"]):
        assert paced["overruns"] >= 0
        assert 0.0 <= paced["wake_error_us"]["p50"] <= paced["wake_error_us"]["p99"] <= paced["wake_error_us"]["max"]
    # Before the robot side knows its operator, a late tick reads as little from it as from anybody.
    assert summary["strangers"].pop("unread") >= 0
    assert set(summary["strangers"].values()) == {0}
    assert summary["door"] == {"restarts": 0, "dropped": 0}
    # A deadline is met by a tick or counted as an overrun (test_pacing.py: each of them), and none is both.
    assert 0 < summary["ticks"] <= summary["ticks"] + summary["overruns"] <= summary["duration_s"] * 1000 + 1


def test_a_side_that_is_killed_or_stands_still_disarms_and_a_signal_ends_each(tmp_path: Path) -> None:
    """What was held back while a side stood still is discarded: only a healthy second and new messages arm again."""
    robots, operators = tmp_path / "robot.json", tmp_path / "operator.json"
    with robot(f"--summary={robots}") as robot_side:
        listening = robot_side.wait_for("listening", LIMIT_S)
        with operator(listening) as killed:
            wait_for_link(killed)
            os.kill(killed.process_id, signal.SIGKILL)
        with operator(listening, f"--summary={operators}") as operator_side:
            assert wait_for_link(operator_side)["state"] == "disarmed"
            for still, other in ((operator_side, robot_side), (robot_side, operator_side)):
                wait_until(
                    robot_side, lambda status: status["state"] == "armed" and (status["R2_pulled"] or 0.0) > 0.05
                )
                other.events()
                os.kill(still.process_id, signal.SIGSTOP)
                wait_until(other, lambda status: status["link"] != "up")
                robot_side.events()
                os.kill(still.process_id, signal.SIGCONT)
                resumed_s = time.monotonic()
                stopped = wait_until(robot_side, lambda status: status["state"] != "armed")
                assert str(stopped["stopped_because"]).startswith(("no command for", "nothing heard for longer than"))
                wait_until(robot_side, lambda status: status["state"] == "armed")
                assert time.monotonic() - resumed_s > SafetySettings().healthy_s
            os.kill(operator_side.process_id, signal.SIGTERM)
            assert operator_side.wait(LIMIT_S) == 0
        os.kill(robot_side.process_id, signal.SIGINT)
        assert robot_side.wait(LIMIT_S) == 0
    assert json.loads(operators.read_text())["triggers_released"] is True
    lease = json.loads(robots.read_text())["lease"]
    # By their age, or because the lease has ended meanwhile.
    assert lease["discarded_by_age"] + lease["commands_of_non_owners"] > 0


def test_an_unknown_key_moves_nothing_until_it_is_allowed_and_a_revoked_one_is_thrown_out(tmp_path: Path) -> None:
    assert KEYS_S <= 0.5  # Out within a second.
    folder, theirs, path = KeyFolder(tmp_path / "robot"), KeyFolder(tmp_path / "anna"), tmp_path / "operator.json"
    (robot_key, robot_secret), (anna_key, anna_secret) = make_key_pair(), make_key_pair()
    folder.write_pair("robot", robot_key, robot_secret)
    theirs.write_pair("operator", anna_key, anna_secret)
    keys = f"--keys={theirs.path}", f"--robot-key={robot_key}"
    with robot(f"--keys={folder.path}") as robot_side:
        listening = robot_side.wait_for("listening", LIMIT_S)
        with operator(listening, *keys, f"--summary={path}") as operator_side:
            is_refused(operator_side, anna_key)
            assert operator_side.stop(LIMIT_S) == 0
        messages = json.loads(path.read_text())["messages"]
        assert messages["stiffness_received"] == 0
        folder.allow("anna", anna_key)
        with operator(listening, *keys) as operator_side:
            wait_for_link(operator_side)
            folder.revoke("anna")
            is_refused(operator_side, anna_key)
        assert robot_side.stop(LIMIT_S) == 0


def is_refused(side: SideProcess, key: str) -> None:
    """Wait until an operator side tells that its key is refused; assert that it stays without a link."""
    wait_until(side, lambda status: f"keys allow NAME {key}" in str(status["link_reason"]))
    assert [side.wait_for("status", LIMIT_S)["link"] == "up" for _ in range(5)] == [False] * 5


def test_a_killed_robot_side_is_an_error_of_the_demo() -> None:
    with start(*DEMO, "--duration", "60", "--status", "json") as process:
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


# Ends at a signal as the interpreter itself does before any of our handlers is installed.
UNPREPARED = [sys.executable, "-c", "import signal; signal.signal(signal.SIGINT, signal.SIG_DFL); signal.pause()"]


def test_our_own_interrupt_of_a_side_that_has_not_begun_is_no_failure() -> None:
    with SideProcess("robot_side", "robot", [], before=UNPREPARED) as side:
        assert side.stop() != 0
        side.check()


# Starts a side that stays in its imports, and prints its id.
PARENT = """
import signal, sys
from feelahead.both_sides.processes import StartedSide
imports = '''print('{"event": "here"}', flush=True)'''
code = f"import signal; from common.command.launch import launch; launch('x', lambda: ({imports}, signal.pause()))"
side = StartedSide("robot", [sys.executable, "-P", "-c", code])
side.wait_for("here", 600.0)
print(side.process_id, flush=True)
signal.pause()
"""


def test_a_side_that_still_starts_ends_with_a_parent_that_is_killed() -> None:
    with start("-c", PARENT) as parent:
        assert parent.stdout is not None
        side = os.pidfd_open(int(parent.stdout.readline()))
        parent.kill()
        ends, _, _ = select.select([side], [], [], LIMIT_S)
        if not ends:
            signal.pidfd_send_signal(side, signal.SIGKILL)
        os.close(side)
    assert ends


def test_another_processs_signal_is_a_failure() -> None:
    with SideProcess("robot_side", "robot", [], before=UNPREPARED) as side:
        os.kill(side.process_id, signal.SIGKILL)
        side.wait(LIMIT_S)
        with pytest.raises(SideFailedError, match="code -9"):
            side.check()


NOWHERE = ("--connect=tcp://127.0.0.1:9", "--device=simulated")
ROBOT = ("--bind=tcp://127.0.0.1:0",)
# No file of this process gets longer than that, as on a full disk.
FULL = """
import os, resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
os.execv(sys.argv[2], sys.argv[2:])
"""


def test_a_summary_on_a_full_disk_is_one_line_and_the_old_one_stays(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    arguments = [*NOWHERE, "--duration=0.2", f"--summary={path}", "--status=none"]
    code, _, complaint = ended("-c", FULL, "100", sys.executable, "-P", "-m", "operator_side", *arguments)
    assert code == 2
    [line] = complaint.splitlines()
    assert line.startswith(f"feelahead-operator: --summary {path}: cannot be written: File too large; valid: ")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_demo_whose_recording_fills_the_disk_says_so_and_fails(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    arguments = ["--duration=3", f"--record={path}", "--no-console", "--status=none"]
    code, _, complaint = ended("-c", FULL, "30000", sys.executable, "-P", "-m", "feelahead", "demo", *arguments)
    assert code == 1
    assert complaint.splitlines()[-1] == "feelahead demo: the recording is not whole: File too large"
    assert 0 < path.stat().st_size <= 30000


@pytest.mark.parametrize(
    ("command", "arguments", "side"),
    [(operator_side.main.command, NOWHERE, OperatorTurns), (robot_side.main.command, ROBOT, RobotTurns)],
    ids=["operator", "robot"],
)
@pytest.mark.parametrize("fails_in", ["opening", "running", "closing"])
def test_a_run_that_fails_in_whatever_way_has_its_summary(
    command: Callable[[Sequence[str]], int],
    arguments: Sequence[str],
    side: type,
    fails_in: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("of no kind that was thought of")

    part, method = {"opening": (side, "__init__"), "running": (Loop, "run"), "closing": (side, "close")}[fails_in]
    monkeypatch.setattr(part, method, fail)
    path = tmp_path / "out.json"
    with pytest.raises(RuntimeError, match="of no kind"):
        command([*arguments, f"--summary={path}", "--status=none", "--duration=0.1"])
    assert json.loads(path.read_text())["errors"] == ["of no kind that was thought of"]


@contextlib.contextmanager
def stalled() -> Iterator[int]:
    """Yield the descriptor of a terminal that is full and that nobody reads."""
    reads, writes = pty.openpty()
    os.set_blocking(writes, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writes, b"x")
    os.set_blocking(writes, True)
    try:
        yield writes
    finally:
        os.close(writes)
        os.close(reads)


def test_a_signal_ends_an_operator_side_with_a_stalled_output(tmp_path: Path) -> None:
    path, command = tmp_path / "out.json", [sys.executable, "-P", "-m", "operator_side", "--device=simulated"]
    with stalled() as output, ServingRobot() as robot:
        ends = [f"--connect={robot.control}", f"--view-connect={robot.view}", "--status=line", f"--summary={path}"]
        with subprocess.Popen([*command, *ends], stdout=output, stderr=subprocess.PIPE, text=True) as process:
            try:
                wait_for("messages", lambda: len(robot.payloads) > 100, LIMIT_S)
                process.send_signal(signal.SIGTERM)
                _, complaint = process.communicate(timeout=LIMIT_S)
            finally:
                process.kill()  # After a failed test.
    assert (process.returncode, complaint) == (0, "")
    assert json.loads(path.read_text())["triggers_released"] is True
