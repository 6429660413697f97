"""Both sides as two real processes: they end cleanly, and crashes and outside failures are reported in one line."""

import contextlib
import json
import os
import pty
import random
import select
import signal
import socket
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
from common.protocol.session import OWNING
from common.sockets.authentication import make_key_pair
from common.sockets.keys import KeyFolder
from feelahead.both_sides.processes import SideFailedError, SideProcess
from operator_side.turns import OperatorTurns
from robot_side.operators.safety import SafetySettings
from robot_side.turns import KEYS_PERIOD_S, RobotTurns
from tests.helpers.hostile.raw_zmtp import RawConnection, port_of
from tests.helpers.python_process import LIMIT_S, ended, start

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


@pytest.mark.parametrize("more", [("--realtime",), ("--compensation", "robot"), ("--law", "paper")])
def test_the_demo_runs_both_sides_and_writes_one_summary(tmp_path: Path, more: tuple[str, ...]) -> None:
    path = tmp_path / "out.json"
    code, _, complaint = ended(*DEMO, "--duration", "4", "--link", "delay 20ms", "--summary", str(path), *more)
    assert code == 0, complaint
    summary = json.loads(path.read_text())
    assert summary["errors"] == []
    assert summary["messages"]["stiffness_received"] > 0
    assert summary["messages"]["motion_received"] > 0
    assert summary["compiled_late"] == 0
    for direction in ("to_robot", "to_operator"):
        # The emulated delay is a floor; a busy machine's excess is for the benchmark.
        assert summary["delay_ms"][direction]["p50"] >= 20.0
    for key in (
        *("duration_s", "ticks", "tick_us", "tick_cpu_us", "skipped", "messages", "delay_ms", "applied_age_ms"),
        *("enlargement_mm", "overlap_mm3", "stiffness", "zones", "min_distance_mm", "contacts", "stops", "errors"),
    ):
        assert key in summary
    for paced in (summary, summary["pacing"]["robot"], summary["pacing"]["operator"]):
        assert paced["overruns"] >= 0
        assert 0.0 <= paced["wake_error_us"]["p50"] <= paced["wake_error_us"]["p99"] <= paced["wake_error_us"]["max"]
    # Before the robot side knows its operator, a late tick reads as little from it as from anybody.
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


@pytest.mark.parametrize("name", ["operator", "robot"])
def test_a_side_that_stood_still_disarms_and_what_was_held_back_is_discarded(tmp_path: Path, name: str) -> None:
    """Stop a side by SIGSTOP in full motion, and continue it: only a healthy second and new messages arm it again."""
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
            assert str(stopped["stopped_because"]).startswith(
                ("no command for", "nothing heard for longer than the lease limit")
            )
            wait_until(robot_side, lambda status: status["state"] == "armed")
            assert time.monotonic() - resumed_s > SafetySettings().healthy_s
        assert robot_side.stop(LIMIT_S) == 0
    if name == "robot":  # By its age, or because its lease has ended meanwhile.
        lease = json.loads(path.read_text())["lease"]
        assert lease["discarded_by_age"] + lease["commands_of_non_owners"] > 0


def test_an_unknown_key_moves_nothing_and_a_revoked_one_is_thrown_out(tmp_path: Path) -> None:
    assert KEYS_PERIOD_S <= 0.5  # Out within a second.
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
                wait_until(operator_side, lambda status: f"keys allow NAME {anna_key}" in str(status["link_reason"]))
                assert [operator_side.wait_for("status", LIMIT_S)["link"] == "up" for _ in range(5)] == [False] * 5
            assert robot_side.stop(LIMIT_S) == 0
        figures = json.loads(path.read_text())
        assert figures["strangers"]["refused"] > 0
        moved.append(figures["messages"]["motion_received"])
        folder.allow("anna", anna_key)
    assert moved[0] == 0 < moved[1]


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
side.wait_for("here", 60.0)
print(side.process_id, flush=True)
signal.pause()
"""


def test_a_side_that_still_starts_ends_with_a_parent_that_is_killed() -> None:
    with start("-c", PARENT) as parent:
        assert parent.stdout is not None
        side = os.pidfd_open(int(parent.stdout.readline()))
        parent.kill()
        ends, _, _ = select.select([side], [], [], 60.0)
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
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
os.execv(sys.argv[1], sys.argv[1:])
"""


def test_a_summary_on_a_full_disk_is_one_line_and_the_old_one_stays(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    arguments = [*NOWHERE, "--duration=0.2", f"--summary={path}", "--status=none"]
    code, _, complaint = ended("-c", FULL, sys.executable, "-P", "-m", "operator_side", *arguments)
    assert code == 2
    [line] = complaint.splitlines()
    assert line.startswith(f"feelahead-operator: --summary {path}: cannot be written: File too large; valid: ")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


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
def stalled(kind: str) -> Iterator[int]:
    """Yield the descriptor of a standard output that is full and that nobody reads."""
    reads, writes = pty.openpty() if kind == "terminal" else os.pipe()
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


@contextlib.contextmanager
def stalling(module: str, output: int, *arguments: str) -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-P", "-m", module, *arguments]
    with subprocess.Popen(command, stdout=output, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()  # After a failed test.


def free_port() -> int:
    """Return a free port below 32768: Linux itself assigns only higher ports, so that no other process gets it."""
    for port in random.SystemRandom().sample(range(20_000, 30_000), 1000):
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
    return pytest.fail("no port is free")


@pytest.mark.parametrize("side", ["robot", "operator"])
@pytest.mark.parametrize(("kind", "mode"), [("pipe", "json"), ("terminal", "line")])
def test_a_signal_ends_a_side_with_a_stalled_output(side: str, kind: str, mode: str, tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    control, view = (f"tcp://127.0.0.1:{free_port()}" for _ in range(2))
    robot = [f"--bind={control}", f"--view-bind={view}"]
    operator = [f"--connect={control}", f"--view-connect={view}", "--device=simulated", f"--summary={path}"]
    stalls, other = (robot, operator) if side == "robot" else (operator, robot)
    with (
        stalled(kind) as output,
        stalling(f"{side}_side", output, *stalls, f"--status={mode}") as process,
        SideProcess("operator_side" if side == "robot" else "robot_side", "other", other) as watching,
    ):
        assert any(watching.wait_for("status", LIMIT_S).get("state") == "armed" for _ in range(5000))
        process.send_signal(signal.SIGTERM)
        _, complaint = process.communicate(timeout=LIMIT_S)
        assert (process.returncode, complaint) == (0, "")
    assert json.loads(path.read_text())["triggers_released"] is True


# Fewer descriptors than strangers open connections.
FEW = """
import os, resource, sys
resource.setrlimit(resource.RLIMIT_NOFILE, (256, 256))
os.execv(sys.argv[1], sys.argv[1:])
"""


def test_strangers_who_only_connect_cost_nobody_the_session(tmp_path: Path) -> None:
    folder, summary = KeyFolder(tmp_path / "keys"), tmp_path / "out.json"
    (robot_key, robot_secret), (anna_key, anna_secret), (ben_key, _) = (make_key_pair() for _ in range(3))
    folder.write_pair("robot", robot_key, robot_secret)
    folder.write_pair("operator", anna_key, anna_secret)
    folder.allow("anna", anna_key)
    folder.allow("ben", ben_key)
    keys = f"--keys={folder.path}"
    with (
        SideProcess(
            "robot_side", "robot", [*ROBOT, keys, f"--summary={summary}"], before=[sys.executable, "-c", FEW]
        ) as robot,
        contextlib.ExitStack() as crowd,
    ):
        listening = robot.wait_for("listening", LIMIT_S)
        ends = [f"--connect={listening['control']}", f"--view-connect={listening['view']}", "--device=simulated"]
        with SideProcess("operator_side", "operator", [*ends, keys, f"--robot-key={robot_key}"]) as operator:
            assert any(robot.wait_for("status", LIMIT_S)["state"] == "armed" for _ in range(5000))
            for endpoint in (listening["control"], listening["view"]):
                for _ in range(300):
                    crowd.enter_context(contextlib.closing(RawConnection(port_of(endpoint))))
            # The list of keys is read again, and the view is opened again, in the crowd.
            folder.revoke("ben")
            robot.events()
            for _ in range(10):
                robot.wait_for("status", LIMIT_S)
            assert any(robot.wait_for("status", LIMIT_S)["owner"] in OWNING for _ in range(5000))
            assert any(operator.wait_for("status", LIMIT_S)["link"] == "up" for _ in range(5000))
            operator.check()
        assert robot.stop(LIMIT_S) == 0
    figures = json.loads(summary.read_text())
    assert figures["errors"] == []
    assert figures["strangers"]["crowded"] > 0
    assert figures["strangers"]["revoked"] == 0
