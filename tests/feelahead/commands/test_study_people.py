"""What happens between the pages, the room and the sides of a study, with made-up sides."""

import json
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from common.errors import ConfigurationError
from feelahead.commands.study import people
from feelahead.commands.study.people import KEPT, LOG, run_people
from feelahead.commands.study.server import PageServer, Said
from feelahead.commands.study.sides import Desk
from feelahead.study.folder import Study
from feelahead.study.room import Page, Seen
from feelahead.study.session import Start
from tests.helpers.repository import ROOT

TEXT = (ROOT / "examples" / "study.toml").read_text().replace("trials = 2 ", "trials = 1 ")


class Clock:
    """Time, which passes as it is slept; and what the experimenter says at each turn."""

    def __init__(self, says: list[dict[str, Any]]) -> None:
        self.now_s, self.says = 100.0, says
        self.refused: list[str] = []
        self.shown: dict[Page, Mapping[str, Any]] = {}

    def heard(self) -> list[Said]:
        return [Said("experimenter", self.says.pop(0), self.refused.append)] if self.says else []

    def show(self, page: Page, state: Mapping[str, Any]) -> None:
        self.shown[page] = state


class Sides:
    """Sides of a trial in which the target is placed at once."""

    def __init__(self, asked: Start, desk: Desk, console_port: int) -> None:
        assert desk.back.read_text().endswith("/")
        assert console_port in (0, 4711)
        self._recording = asked.recording

    def look(self, _: float) -> Seen:
        return Seen("up", "connected", armed=True, placed=True, console="http://127.0.0.1:4711/x/")

    def close(self, pool: ThreadPoolExecutor) -> "Future[str | None]":
        self._recording.write_text("whole")
        return pool.submit(lambda: None)


def refuses(*_: object) -> None:
    raise ConfigurationError("--record: No space left on device")


@pytest.fixture
def study(tmp_path: Path) -> Iterator[Study]:
    file = tmp_path / "study.toml"
    file.write_text(TEXT)
    with Study(tmp_path / "study", file) as study:
        yield study


def run(study: Study, monkeypatch: pytest.MonkeyPatch, says: list[dict[str, Any]], sides: object) -> Clock:
    """Run the study until all was said and no trial runs any more."""
    clock = Clock(says)

    class Stop:
        def __enter__(self) -> "Stop":
            return self

        def __exit__(self, *_: object) -> None:
            pass

        @property
        def is_set(self) -> bool:
            clock.now_s += 0.3
            return not clock.says and clock.shown["experimenter"]["phase"] is None

    monkeypatch.setattr(people, "StopSignal", Stop)
    monkeypatch.setattr(people, "TrialSides", sides)
    times = SimpleNamespace(sleep=lambda _: None, monotonic=lambda: clock.now_s, time=lambda: 1e9 + clock.now_s)
    monkeypatch.setattr(people, "time", times)
    monkeypatch.setattr(PageServer, "heard", clock.heard)
    monkeypatch.setattr(PageServer, "show", clock.show)
    run_people(study, None)
    assert not (study.folder / KEPT).exists()
    return clock


COMES: list[dict[str, Any]] = [{"event": "choose", "participant": 1}, {"event": "enrolled"}, {"event": "consented"}]


def test_a_trial_goes_from_the_page_to_the_sides_and_into_the_journal(
    study: Study, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = run(study, monkeypatch, [*COMES, {"event": "begun"}, {"event": "rested"}, {"event": 7}], Sides)
    [attempt] = study.journal.progress(1).attempts
    assert (attempt.status, attempt.success) == ("complete", True)
    assert clock.refused[:4] == [""] * 4
    assert "valid: choose" in clock.refused[4]
    assert "event 7" in clock.refused[5]
    assert clock.shown["experimenter"]["open"] == {"experimenter": False, "participant": False}
    said = capsys.readouterr().out.splitlines()
    assert [line.partition(": http://127.0.0.1:")[0] for line in said] == [
        "page of the experimenter",
        "page of the participant",
    ]


def test_a_recorder_that_cannot_start_is_a_fault_and_the_trial_comes_again(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = run(study, monkeypatch, [*COMES, {"event": "begun"}], refuses)
    [attempt] = study.journal.progress(1).attempts
    assert (attempt.status, attempt.reason) == ("fault", "the recorder could not be started")
    assert clock.shown["experimenter"]["attempt"] == 2
    assert [json.loads(line) for line in (study.folder / LOG).read_text().splitlines()] == [
        {"what": "the recorder could not be started", "reason": "--record: No space left on device"}
    ]
