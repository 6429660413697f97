import contextlib
import json
import math
import signal
from collections.abc import Sequence
from typing import Any

import msgspec
import pytest
import rich.console

from common.command.command_line import run_command
from common.command.status import Status, StatusMode
from common.errors import ConfigurationError
from common.status.codes import LinkState
from common.status.statuses import OperatorStatus, RobotStatus


def shown(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()


def events(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in shown(capsys)]


def test_json_says_codes_and_figures_and_of_each_side_what_it_knows_better(capsys: pytest.CaptureFixture[str]) -> None:
    robot = RobotStatus(link=LinkState.UP, state="armed", l2_course_stiffness=0.1, target="carton", real_time=math.nan)
    operator = OperatorStatus(link=LinkState.LOST, holding=True, place=3)
    with Status("json", "robot") as status:
        status.show(0.0, robot=robot, operator=operator)
        status.event("listening", control="tcp://127.0.0.1:5555")
        status.event("bare")
        status.show(1.0, robot=robot)
    both, listening, bare, alone = events(capsys)
    expected = {"event": "status", "link": "lost", "state": None, "L2_course_stiffness": None, "target": "carton"}
    assert {name: both[name] for name in expected} == expected
    assert (both["holding"], both["place"], both["real_time"]) == (None, 3, None)
    assert [listening, bare] == [{"event": "listening", "control": "tcp://127.0.0.1:5555"}, {"event": "bare"}]
    assert (alone["link"], alone["L2_course_stiffness"], alone["nearest_mm"]) == ("up", 0.1, None)
    assert "place" not in alone


def test_without_a_terminal_only_what_changed_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with Status("line", "robot") as status:
        for tick in range(5000):
            armed = tick >= 3000
            said = RobotStatus(link=LinkState.UP, state="armed" if armed else "disarmed", observers=tick)
            status.show(100.0 + tick / 1000, robot=said)
    assert shown(capsys) == ["   0.0 s  link up; disarmed", "   3.0 s  armed"]


def test_notes_are_for_people_and_programs_and_events_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    text = "listening at [bold]tcp://127.0.0.1:5555[/bold]" + ", and so on" * 30
    modes: tuple[StatusMode, ...] = ("line", "json", "none")
    of_mode = {}
    for mode in modes:
        with Status(mode, "robot") as status:
            status.note(text)
            status.event("listening")
        of_mode[mode] = shown(capsys)
    # Long notes are not broken into lines, and brackets are no markup.
    of_programs = [json.dumps({"event": "note", "text": text}), '{"event": "listening"}']
    assert of_mode == {"line": [f"robot: {text}"], "json": of_programs, "none": []}


HOSTILE = "a\x1b[2Jb\nrobot: listening\x9b1m\u202e\U000e0001"


def test_texts_of_others_write_no_line_and_move_no_cursor(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    stopped = RobotStatus(link=LinkState.UP, state="stopped", stopped_because=HOSTILE, holding=HOSTILE)
    touching = RobotStatus(link=LinkState.UP, state="armed", hindrance=HOSTILE, nearest=HOSTILE, nearest_mm=0.0)
    modes: tuple[StatusMode, ...] = ("line", "json")
    for mode in modes:
        with Status(mode, "robot") as status:
            status.note(HOSTILE)
            status.show(0.0, robot=stopped)
            status.show(9.0, robot=touching)
        lines = shown(capsys)
        assert len(lines) == 3
        assert all(line.isprintable() for line in lines)
    assert [json.loads(line) for line in lines][1]["stopped_because"] == HOSTILE
    monkeypatch.setattr(rich.console.Console, "is_terminal", True)
    monkeypatch.setenv("TERM", "xterm")
    with Status("line", "robot") as status:
        status.show(0.0, robot=stopped)
        status.note(HOSTILE)
    assert "[2J" in (drawn := capsys.readouterr().out)
    assert not {"\x1b[2J", "\x9b", "\u202e"} & {drawn[at : at + size] for at in range(len(drawn)) for size in (1, 4)}


def test_the_error_of_a_command_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: Sequence[str]) -> int:
        raise ConfigurationError(f"model: {HOSTILE}; valid: another one")

    monkeypatch.setattr(signal, "signal", lambda *_: None)
    with pytest.raises(SystemExit):
        run_command("robot", refuse)
    [line] = capsys.readouterr().err.splitlines()
    assert line.isprintable()
    assert line.startswith("robot: model: a?[2Jb?robot: listening?1m")


class Facts(msgspec.Struct):
    a: float
    b: str | None = None


def test_facts_are_for_programs_that_want_them_ten_times_a_second(capsys: pytest.CaptureFixture[str]) -> None:
    modes: tuple[StatusMode, ...] = ("line", "json", "none")
    for mode in modes:
        with Status(mode, "robot") as status:
            assert not status.wants_facts
            status.show_facts(Facts(0.5))
    assert shown(capsys) == []
    with Status("facts", "robot") as status:
        assert status.wants_facts
        for tick in range(1000):
            if status.due(now_s := 50.0 + tick / 1000):
                status.show(now_s)
                status.show_facts(Facts(now_s))
        status.note("noted")
        assert status.event("bare")
    found = events(capsys)
    assert [event["event"] for event in found] == [*["status", "facts"] * 10, "note", "bare"]
    assert found[1]["facts"] == {"a": 50.0, "b": None}


def test_on_a_terminal_one_line_is_kept_up_to_date(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "40")
    with contextlib.suppress(RuntimeError), Status("line", "robot") as status:
        for tick in range(1000):
            status.show(tick / 1000, robot=RobotStatus(link=LinkState.UP, l2_pulled=tick / 100, nearest_mm=5.0))
        status.note("a line that stays")
        raise RuntimeError("in the loop")
    written = capsys.readouterr().out
    updates = [tick for tick in range(1000) if f"pull {tick}/–%" in written]
    assert updates == pytest.approx([0, 200, 400, 600, 800], abs=5)
    assert "a line that stays" in written
    # The story stays above the line, broken between words.
    assert "   0.0 s  link up; starting" in written
    # Whole facts only: there is no room for the distances.
    assert "starting  L2/R2 pull 0/–% resist –/–%\r" in written
    # The hidden cursor comes back, also after an error.
    assert written.rindex("\x1b[?25h") > written.rindex("\x1b[?25l")
