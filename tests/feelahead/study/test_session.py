"""A session by a script: what pages and sides say, with faults, a pause, a full disk and a withdrawal."""

import errno
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from common.errors import FeelaheadError
from feelahead.study.folder import TRIALS, Study, read_study
from feelahead.study.records import trial_records
from feelahead.study.session import Session, Start, Stop
from tests.helpers.repository import ROOT

TEXT = (ROOT / "examples" / "study.toml").read_text().replace("trials = 2 ", "trials = 1 ")
SECRETS = ("off", "swept", "paper", "margin", "assist", "wall", "slot", "haptics", "delay", "seed", "300")


class Room:
    """The pages, the sides and the time of one participant."""

    def __init__(self, study: Study, participant: int = 1) -> None:
        self.session = Session(study, participant)
        self.now_s = 100.0

    def say(self, event: str, **fields: Any) -> Start | Stop | None:
        return self.session.hear({"event": event, **fields}, self.now_s, 1e9 + self.now_s)

    def shown(self) -> Mapping[str, Any]:
        found = self.session.view(self.now_s)
        assert not [word for word in SECRETS if f'"{word}' in json.dumps(found)]
        return {**found["experimenter"], **found["participant"]}

    def start(self) -> Start:
        start = self.say("begun")
        assert isinstance(start, Start)
        start.recording.write_text(start.recording.name)
        self.session.up(self.now_s)
        return start

    def run(self, success: bool = True) -> Start:
        start = self.start()
        self.now_s += 20.0
        self.session.ended("placed" if success else "limit", 1e9 + self.now_s)
        return start

    def go(self, until: str) -> None:
        """Do what comes until the step `until`."""
        while (step := self.shown()["step"]) != until:
            match step:
                case "enrol" | "consent" | "pause":
                    self.say({"enrol": "enrolled", "consent": "consented", "pause": "resumed"}[step])
                case "practice" | "trial":
                    self.run()
                case "rest":
                    self.now_s += 60.0
                    self.say("rested")
                case "questions":
                    values = {one["name"]: one["values"][0] for one in self.shown()["asked"]}
                    self.say("answered", block=self.shown()["block"], values=values)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "study.toml"
    path.write_text(TEXT)
    return path


@pytest.fixture
def study(file: Path, tmp_path: Path) -> Iterator[Study]:
    with Study(tmp_path / "study", file) as study:
        yield study


def _rows(study: Study) -> list[tuple[int, int, str, str | None]]:
    records = trial_records(*read_study(study.folder))
    return [(one.trial, one.attempt, one.status, one.excluded) for one in records if not one.practice]


def test_a_whole_session_meets_each_condition_and_shows_none(study: Study) -> None:
    room = Room(study)
    room.go("done")
    assert _rows(study) == [(number, 1, "complete", None) for number in range(1, 31)]
    assert room.shown()["trials_done"] == 30


def test_a_start_has_what_the_sides_need(study: Study) -> None:
    room = Room(study)
    room.go("trial")
    start = room.start()
    assert start.condition == study.protocol.conditions[start.planned.condition]
    assert start.recording == study.folder / TRIALS / "unfinished-p01-t001.mcap"
    assert room.shown()["running"]
    with pytest.raises(ValueError, match="begun does not come now; valid: what goes with trial"):
        room.say("begun")


def test_a_trial_has_its_time_from_when_the_sides_are_up(study: Study) -> None:
    room = Room(study)
    room.go("trial")
    assert isinstance(room.say("begun"), Start)
    assert room.session.turn(room.now_s + 1000.0) is None
    room.session.up(room.now_s)
    (study.folder / TRIALS / "unfinished-p01-t001.mcap").write_text("whole")
    assert room.session.turn(room.now_s + 44.9) is None
    assert room.session.turn(room.now_s + 45.0) == Stop("time limit")
    assert room.session.turn(room.now_s + 46.0) is None
    assert room.shown()["running"]
    room.session.ended("limit", 0.0)
    assert (room.shown()["running"], room.shown()["number"]) == (False, 2)


def test_faults_are_repeated_and_marked_by_side_by_experimenter_and_after_the_end(study: Study) -> None:
    room = Room(study)
    room.go("trial")
    room.start()
    room.session.lost("the robot side ended", 0.0)
    room.start()
    assert room.say("failed", reason="the phone rang") == Stop("failed")
    room.run()
    assert room.shown()["may_repeat"]
    assert room.say("failed", reason="looked away", trial=9) is None
    assert not room.shown()["may_repeat"]
    with pytest.raises(ValueError, match="failed does not come now"):
        room.say("failed", reason="once more")
    room.run()
    assert _rows(study) == [
        (1, 1, "fault", "the robot side ended"),
        (1, 2, "fault", "the phone rang"),
        (1, 3, "fault", "looked away"),
        (1, 4, "complete", None),
    ]
    assert room.shown()["faults"] == ["the robot side ended", "the phone rang", "looked away"]
    # A side that ends late says nothing new.
    room.session.ended("placed", 0.0)
    room.session.lost("late", 0.0)
    assert len(_rows(study)) == 4


def test_a_pause_lets_the_trial_end_and_holds_the_next(study: Study) -> None:
    room = Room(study)
    room.go("trial")
    room.start()
    room.say("paused")
    assert room.shown()["running"]
    room.session.ended("placed", 0.0)
    assert room.shown()["step"] == "pause"
    with pytest.raises(ValueError, match="begun does not come now; valid: what goes with pause"):
        room.say("begun")
    room.say("resumed")
    assert room.run().planned.number == 2


def test_a_rest_has_its_time(study: Study) -> None:
    room = Room(study)
    room.go("rest")
    assert room.shown()["rest_left_s"] == 60.0
    room.now_s += 59.0
    with pytest.raises(ValueError, match="rested: 1 s are left"):
        room.say("rested")
    room.now_s += 1.0
    room.say("rested")
    assert room.shown()["step"] == "trial"


def test_practice_counts_successes(study: Study) -> None:
    room = Room(study)
    room.go("practice")
    for success in (True, True, False, True, True):
        room.run(success)
        assert room.shown()["practised"] is None
    room.run()
    assert (room.shown()["practised"], room.shown()["step"]) == (True, "trial")


@pytest.mark.parametrize("running", [False, True])
def test_who_withdraws_stops_the_sides_and_leaves_a_number(study: Study, running: bool) -> None:
    other, room = Room(study, 2), Room(study)
    other.go("rest")
    room.go("rest")
    if running:
        room.go("trial")
        room.start()
    assert room.say("withdrew", reason="felt sick") == (Stop("withdrew") if running else None)
    room.session.ended("placed", 0.0)
    assert room.shown()["step"] == "withdrawn"
    assert {path.name[:3] for path in (study.folder / TRIALS).iterdir()} == {"p02"}
    with pytest.raises(ValueError, match="begun does not come now"):
        room.say("begun")
    other.go("done")


def test_an_end_that_a_full_disk_refuses_is_written_when_there_is_room(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    room = Room(study)
    room.go("trial")
    room.start()

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        room.session.ended("placed", 0.0)
        assert room.session.turn(room.now_s) is None
        assert "No space left on device" in room.shown()["trouble"]
        assert room.shown()["running"]
        with pytest.raises(FeelaheadError, match="No space left"):
            room.say("paused")
    assert room.session.turn(room.now_s) is None
    assert (room.shown()["trouble"], room.shown()["running"]) == (None, False)
    assert _rows(study) == [(1, 1, "complete", None)]


def test_a_new_session_goes_on_where_the_killed_one_was(study: Study) -> None:
    room = Room(study)
    room.go("rest")
    room.go("trial")
    room.start()
    again = Room(study)
    assert (again.shown()["number"], again.shown()["attempt"], again.shown()["running"]) == (13, 2, False)
    again.go("done")
    assert [row for row in _rows(study) if row[2] != "complete"] == [(13, 1, "fault", "interrupted")]


@pytest.mark.parametrize(
    "said",
    [{}, {"event": "slept"}, {"event": "ended", "success": True}, {"event": "withdrew", "more": 1}, {"event": 3}],
)
def test_what_no_page_may_say_is_refused(study: Study, said: Mapping[str, Any]) -> None:
    room = Room(study)
    room.go("trial")
    with pytest.raises(ValueError, match=r"event|slept|ended|more|str"):
        room.session.hear(said, 0.0, 0.0)
