"""The demo: the flags that it gives to both sides, its page, and its messages when a side ends early."""

import json
import os
import re
import signal
import sys
import threading
import webbrowser
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from common.command.command_line import given_fields, parse_settings
from common.command.status import Status
from common.errors import ConfigurationError
from common.skipped import Part, shares
from feelahead.both_sides.processes import SideFailedError
from feelahead.both_sides.summary import merge_summaries
from feelahead.commands import open_browser
from feelahead.commands.demo import command as module
from feelahead.commands.demo import run
from feelahead.commands.demo.command import demo
from feelahead.commands.demo.run import operator_arguments, robot_arguments, too_slow
from feelahead.commands.demo.settings import DemoSettings
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings
from tests.helpers.python_process import start
from tests.helpers.refusal import refusal
from tests.operator_side.viewing.terminal.on_terminal import OnTerminal

LISTENING = {"control": "tcp://127.0.0.1:1", "view": "tcp://127.0.0.1:2"}


def passed_on(*arguments: str) -> tuple[list[str], list[str]]:
    settings = parse_settings(DemoSettings, "demo", arguments)
    given = given_fields(arguments, DemoSettings)
    path = Path("summary.json")
    robot = robot_arguments(settings, given, path, LISTENING)
    return robot, operator_arguments(settings, given, path, LISTENING)


def test_only_what_was_said_goes_over_the_sides_own_files(tmp_path: Path) -> None:
    config = tmp_path / "robot.toml"
    config.write_text("seed = 3\nprobability = 0.5\n")
    robot, operator = passed_on("--robot-config", str(config))
    ports = ["--bind=tcp://127.0.0.1:1", "--view-bind=tcp://127.0.0.1:2"]
    assert robot == ["--summary=summary.json", *ports, f"--config={config}", "--cameras.at-once"]
    assert "--cameras.at-once" not in passed_on("--no-console")[0]
    unsaid = ("--seed", "--link", "--haptics", "--no-haptics", "--law", "--compensation")
    assert not [flag for flag in operator if flag.startswith(unsaid)]


@pytest.mark.parametrize("flag", ["--robot-config", "--operator-config"])
def test_a_sides_file_is_checked_before_a_side_is_started(flag: str, tmp_path: Path) -> None:
    config = tmp_path / "side.toml"
    config.write_text("nothing = 1")
    with pytest.raises(ConfigurationError, match=f"^{flag} .*unknown key 'nothing'; valid: "):
        demo([flag, str(config)])


@pytest.mark.parametrize(
    ("flags", "written", "said"),
    [
        ("--law part.py", None, "law part.py: there is no such file; valid: a Python file that defines law"),
        ("--law part.py", "law = (", "law part.py: SyntaxError, part.py line 1: '(' was never closed"),
        ("--law part.py", "x = 1", "law part.py: the file defines no law"),
        ("--law part.py", "import no_such", "law part.py: ModuleNotFoundError, part.py line 1: No module"),
        ("--person-file part.py", "person = 3", "person: int lacks act"),
        ("--model part.xml --site tool", "<mujoco", "model part.xml: XML parse error"),
    ],
)
def test_a_part_is_refused_before_a_side_is_started(
    flags: str, written: str | None, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(module, "run_both", lambda *_: pytest.fail("a side was started"))
    if written is not None:
        Path(flags.split()[1]).write_text(written)
    assert refusal(demo, flags.split()).startswith(said)


def test_a_missing_package_is_said_before_a_side_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setattr(module, "run_both", lambda *_: pytest.fail("a side was started"))
    assert re.search(r"mujoco is not installed; .*\[robot\]", refusal(demo, []))


def test_given_flags_are_passed_on_to_the_side_that_takes_them_even_if_default(tmp_path: Path) -> None:
    given = "--seed", "0", "--link=delay 5ms", "--probability", "0.99", "--haptics", "--realtime", "--scene", "wall"
    robot, operator = passed_on(*given)
    assert {"--seed=0", "--link=delay 5ms", "--probability=0.99", "--realtime", "--scene=wall"} <= set(robot)
    assert {"--seed=0", "--link=delay 5ms", "--haptics", "--realtime"} <= set(operator)
    config = tmp_path / "demo.toml"
    config.write_text('link = "delay 5ms"\nhaptics = false\nlaw = "paper"\ncompensation = "robot"\n')
    robot, operator = passed_on("--config", str(config))
    assert {"--link=delay 5ms", "--law=paper"} <= set(robot)
    assert {"--no-haptics", "--compensation=robot"} <= set(operator)
    # Each side accepts its arguments, and gets none of the other's.
    assert parse_settings(RobotSettings, "robot", robot).law == "paper"
    assert parse_settings(OperatorSettings, "operator", operator).compensation == "robot"


def test_the_summary_and_the_errors_do_not_depend_on_the_reader(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*arguments: object) -> list[str]:
        status = arguments[-1]
        assert isinstance(status, Status)
        status.note("to nobody")
        return ["the robot side ended early"]

    reads, writes = os.pipe()
    os.close(reads)
    monkeypatch.setattr(module, "run_both", run)
    path = tmp_path / "out.json"
    with os.fdopen(writes, "w", encoding="utf-8") as gone:
        monkeypatch.setattr(sys, "stdout", gone)
        assert demo(["--summary", str(path)]) == 1
    assert json.loads(path.read_text())["errors"] == ["the robot side ended early"]
    assert capsys.readouterr().err == "feelahead demo: the robot side ended early\n"


def test_a_link_over_which_the_sides_cannot_meet_is_the_reason() -> None:
    with pytest.raises(ConfigurationError, match=r"--link 'delay 1e9ms'.* take 2e\+06 s; valid: below 30 s"):
        demo(["--link", "delay 1e9ms", "--status", "none"])
    assert too_slow(DemoSettings(link="delay 14s")) is None
    assert too_slow(DemoSettings(link="to_robot: delay 31s")) is not None


@pytest.mark.parametrize(
    ("fault", "said"), [(SideFailedError("code -9"), "code -9"), (None, "the robot side ended early")]
)
def test_a_side_that_ends_is_an_error(fault: SideFailedError | None, said: str) -> None:
    side = Mock(running=False, check=Mock(side_effect=fault), events=list)
    side.name = "robot"
    assert run._watch(DemoSettings(), side, side, Mock(is_set=False), Status("none", "demo")) == [said]


@pytest.mark.processes
def test_a_reader_that_has_seen_enough_ends_the_demo_quietly() -> None:
    with start("-m", "feelahead", "demo", "--duration", "60", "--status", "json") as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert json.loads(process.stdout.readline())["event"] == "note"
        process.stdout.close()
        complaint = process.stderr.read()
        code = process.wait(timeout=600)
    assert (code, complaint) == (0, "")


@pytest.mark.processes
def test_ctrl_c_while_a_side_still_starts_ends_the_demo_at_once(tmp_path: Path) -> None:
    with start(
        "-m", "feelahead", "demo", "--duration", "60", "--status", "json", "--summary", str(tmp_path / "out.json")
    ) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["event"] == "note"
        assert json.loads(process.stdout.readline()) | {"process_id": 0} == {
            "event": "started",
            "side": "robot",
            "process_id": 0,
        }
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=600)
    assert (process.returncode, complaint) == (0, "")


@pytest.mark.processes
def test_the_demo_is_drawn_from_the_facts_of_both_sides_and_gives_the_terminal_back() -> None:
    demo = OnTerminal([sys.executable, "-P", "-m", "feelahead", "demo", "--tui", "--no-console", "--duration", "600"])
    try:
        # The delay and the zones are the operator side's, the nearest object and the ticks the robot side's.
        for said in (b"starting", b"link ", b" mean ", b"R2 advances", b"nearest ", b"tick p99", b"ARMED"):
            demo.read_until(re.compile(re.escape(said)).search)
        assert demo.end() == 0
        assert b"contacts with obstacles" in demo.seen
        assert demo.is_put_back()
        # The report remains on the first screen.
        assert b"feelahead demo: delay: " in demo.seen.rpartition(b"\x1b[?1049l")[2]
    finally:
        demo.close()


ADDRESS = "http://127.0.0.1:1/token/"


@pytest.mark.parametrize(
    ("terminal", "display", "opens"), [(True, ":0", True), (True, "", False), (False, ":0", False)]
)
def test_it_opens_in_a_terminal_with_a_display_alone(
    terminal: bool, display: str, opens: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened, done = [], threading.Event()

    def open_it(address: str) -> None:
        opened.append(address)
        done.set()

    monkeypatch.setattr(webbrowser, "open", open_it)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    open_browser.show_address(ADDRESS, Status("none", "test"))
    if opens:
        done.wait(20.0)
    assert opened == [ADDRESS] * opens


ROBOT: dict[str, Any] = {
    "ticks": 10_000,
    "messages": {"stiffness_sent": 990, "motion_received": 240, "rejected": 3, "stale": 5},
    "delay_ms": {"to_robot": {"mean": 50.0, "p99": 71.0}},
    "applied_age_ms": {"to_robot": {"mean": 48.0}},
    "stops": [{"time_s": 3.0, "reason": "no command for 100 ms"}],
    "task": {"lifted_mm": 100.0},
    "min_distance_mm": None,
    "errors": ["robot: out of paper"],
}
OPERATOR: dict[str, Any] = {
    "messages": {"stiffness_received": 980, "motion_sent": 250, "rejected": 1, "stale": 20},
    "delay_ms": {"to_operator": {"mean": 20.0}, "round_trip": {"mean": 70.0}},
    "applied_age_ms": {"to_operator": {"mean": 19.0}},
    "errors": ["operator: asleep"],
}


def test_the_last_line_says_what_was_not_needed_and_nothing_of_what_is_not_known() -> None:
    robot = shares(pairs=Part(21, 1000), looks=Part(3, 4), stiffness_messages=Part(10, 100), kernels=Part(0, 0))
    operator = shares(motion_messages=Part(40, 100), writes=Part(1, 8))
    merged = merge_summaries({"skipped": robot}, {"skipped": operator}, [])
    assert module.left_out(merged["skipped"]) == [
        "not done, because it was not needed: 97 % of the pairs of sphere and primitive, 25 % of the looks,"
        " 75 % of the messages, 87 % of the writes"
    ]
    assert module.left_out({}) == []


def test_what_each_side_alone_knows_stands_beside_the_others() -> None:
    merged = merge_summaries(ROBOT, OPERATOR, [])
    assert merged["ticks"] == 10_000
    assert merged["min_distance_mm"] is None
    assert merged["stops"] == ROBOT["stops"]
    assert merged["task"] == {"lifted_mm": 100.0}
    assert merged["delay_ms"] == {
        "to_robot": {"mean": 50.0, "p99": 71.0},
        "to_operator": {"mean": 20.0},
        "round_trip": {"mean": 70.0},
    }
    assert merged["applied_age_ms"] == {"to_robot": {"mean": 48.0}, "to_operator": {"mean": 19.0}}
    # Counts of both are added.
    assert merged["messages"] == {
        "stiffness_sent": 990,
        "stiffness_received": 980,
        "motion_sent": 250,
        "motion_received": 240,
        "rejected": 4,
        "stale": 25,
    }


def test_a_side_that_left_no_summary_takes_nothing_from_the_other_and_every_error_is_kept() -> None:
    alone = merge_summaries(ROBOT, {}, ["the operator side failed"])
    assert alone == ROBOT | {"errors": ["robot: out of paper", "the operator side failed"]}
    assert merge_summaries({}, OPERATOR, []) == OPERATOR
    assert merge_summaries(ROBOT, OPERATOR, [])["errors"] == ["robot: out of paper", "operator: asleep"]
