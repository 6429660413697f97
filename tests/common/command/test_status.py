import contextlib
import itertools
import json
import os
import sys
from typing import Any

import msgspec
import pytest

from common.command.live_view import Value
from common.command.status import Status, StatusMode


def shown(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()


def events(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in shown(capsys)]


def run(mode: StatusMode, seconds: float, start_s: float = 100.0) -> None:
    """`show` once a millisecond."""
    with Status(mode, "robot") as status:
        for tick in range(round(seconds * 1000)):
            status.show(start_s + tick / 1000, {"tick": tick})


def test_json_is_one_event_a_line_five_times_a_second(capsys: pytest.CaptureFixture[str]) -> None:
    run("json", 2.0)
    found = events(capsys)
    assert [event["event"] for event in found] == ["status"] * 10
    assert [event["tick"] for event in found] == pytest.approx(range(0, 2000, 200), abs=10)


def test_json_keeps_the_values_types(capsys: pytest.CaptureFixture[str]) -> None:
    values: dict[str, Value] = {"a": 0.125, "b": 3, "c": "armed", "d": True, "e": None}
    with Status("json", "robot") as status:
        status.show(0.0, values)
        status.event("listening", control="tcp://127.0.0.1:5555")
        status.event("bare")
    assert events(capsys) == [
        {"event": "status"} | values,
        {"event": "listening", "control": "tcp://127.0.0.1:5555"},
        {"event": "bare"},
    ]


def test_without_a_terminal_only_what_changed_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with Status("line", "robot") as status:
        for tick in range(5000):
            armed = tick >= 3000
            status.show(100.0 + tick / 1000, {"tick": tick, "link": "up", "state": "armed" if armed else "disarmed"})
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
                status.show(now_s, {"tick": tick})
                status.show_facts(Facts(now_s))
        status.note("noted")
        assert status.event("bare")
    found = events(capsys)
    assert [event["event"] for event in found] == [*["status", "facts"] * 10, "note", "bare"]
    assert found[1]["facts"] == {"a": 50.0, "b": None}


def test_due_says_whether_show_would_show(capsys: pytest.CaptureFixture[str]) -> None:
    period_s = 0.2
    with Status("json", "robot") as status:
        assert status.due(10.0)
        assert status.due(10.0)
        status.show(10.0, {"tick": 0})
        assert not status.due(10.0)
        assert not status.due(10.0 + 0.99 * period_s)
        assert status.due(10.0 + 1.01 * period_s)
        status.show(10.0 + 0.99 * period_s, {"tick": 1})
        status.show(10.0 + 1.01 * period_s, {"tick": 2})
    assert len(shown(capsys)) == 2


def test_on_a_terminal_one_line_is_kept_up_to_date(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "40")
    with Status("line", "robot") as status:
        for tick in range(1000):
            status.show(tick / 1000, {"state": f"tick {tick}", "nearest_mm": 5.0})
        status.note("a line that stays")
    written = capsys.readouterr().out
    updates = [tick for tick in range(1000) if f"tick {tick} " in written]
    assert updates == pytest.approx([0, 200, 400, 600, 800], abs=5)
    assert "a line that stays" in written
    # Whole facts only: there is no room for the distances.
    assert "tick 0  L2/R2 pull –/–% resist 0/0%\r" in written
    # The cursor that was hidden comes back.
    assert written.rindex("\x1b[?25h") > written.rindex("\x1b[?25l")


def test_the_terminal_is_given_back_after_an_error_too(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")

    def fail() -> None:
        with Status("line", "robot") as status:
            status.show(0.0, {"tick": 1})
            raise RuntimeError("in the loop")

    with pytest.raises(RuntimeError, match="in the loop"):
        fail()
    written = capsys.readouterr().out
    assert written.rindex("\x1b[?25h") > written.rindex("\x1b[?25l")


def test_a_json_reader_that_has_gone_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    read_end, write_end = os.pipe()
    stream = os.fdopen(write_end, "w", encoding="utf-8")
    os.close(read_end)
    monkeypatch.setattr(sys, "stdout", stream)

    def run() -> None:
        with Status("json", "robot") as status:
            for second in itertools.count():
                status.show(float(second), {"tick": 0})

    with pytest.raises(BrokenPipeError):
        run()
    with contextlib.suppress(BrokenPipeError):
        stream.close()
