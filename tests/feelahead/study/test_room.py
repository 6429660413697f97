"""A study in the room by a script: what both pages say, what is heard of the sides, and what the pages show."""

import errno
import json
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.errors import FeelaheadError
from feelahead.study.balance import most_minutes
from feelahead.study.events import Ended
from feelahead.study.folder import JOURNAL, TRIALS, Study, read_study
from feelahead.study.records import trial_records
from feelahead.study.room import Page, Room, Seen
from feelahead.study.session import Start, Stop
from tests.helpers.repository import ROOT

TEXT = (ROOT / "examples" / "study.toml").read_text().replace("trials = 2 ", "trials = 1 ")
SECRETS = ("off", "swept", "paper", "margin", "assist", "wall", "slot", "haptics", "delay", "seed", "300")
UP = Seen("up", "connected", console="http://127.0.0.1:1/token/")
ARMED = replace(UP, armed=True, placed=False)


class Desk:
    """The room, and the time in it."""

    def __init__(self, study: Study, participant: int | None = None) -> None:
        self.study, self.room, self.now_s = study, Room(study, participant), 100.0

    def say(self, page: Page, event: str, **fields: Any) -> Start | Stop | None:
        return self.room.hear(page, {"event": event, **fields}, self.now_s, 1e9 + self.now_s)

    def tell(self, event: str, **fields: Any) -> Start | Stop | None:
        return self.say("experimenter", event, **fields)

    def see(self, seen: Seen, passed_s: float = 0.0) -> Stop | None:
        self.now_s += passed_s
        return self.room.take(seen, self.now_s)

    def close(self, error: str | None = None) -> None:
        self.room.closed(error, self.now_s, 1e9 + self.now_s)

    def turn(self, passed_s: float = 0.0) -> Stop | None:
        self.now_s += passed_s
        return self.room.turn(self.now_s, 1e9 + self.now_s)

    def shown(self, page: Page = "experimenter") -> dict[str, Any]:
        found = self.room.view(self.now_s)
        assert not [word for word in SECRETS if f'"{word}' in json.dumps(found)]
        return found[page]

    def begin(self) -> Start:
        start = self.tell("begun")
        assert isinstance(start, Start)
        start.recording.write_text(start.recording.name)
        return start

    def place(self) -> None:
        self.begin()
        assert self.see(ARMED) is None
        assert self.see(replace(ARMED, placed=True), 20.0) is None
        assert self.see(replace(ARMED, placed=True), 1.0) == Stop("placed")
        self.close()

    def come(self, participant: int = 1) -> None:
        """Let a participant come, agree, and practise."""
        self.tell("choose", participant=participant)
        self.tell("enrolled")
        self.tell("consented")
        while self.shown()["step"] == "practice":
            self.place()

    @property
    def rows(self) -> list[tuple[int, int, str, str | None]]:
        records = trial_records(*read_study(self.study.folder))
        return [(one.trial, one.attempt, one.status, one.excluded) for one in records if not one.practice]


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    file = tmp_path / "study.toml"
    file.write_text(TEXT)
    with Study(tmp_path / "study", file) as study:
        yield Desk(study)


def test_a_trial_ends_once_the_target_stands(desk: Desk) -> None:
    desk.come()
    start = desk.begin()
    assert start.condition == desk.study.protocol.conditions[start.planned.condition]
    assert (desk.shown()["phase"], desk.shown("participant")["console"]) == ("starting", None)
    assert desk.see(UP) is None
    assert desk.shown("participant")["console"] == UP.console
    assert desk.see(ARMED) is None
    for placed in (True, False, True):  # it stands, is touched, and stands again
        assert desk.see(replace(ARMED, placed=placed), 0.3) is None
    assert desk.see(replace(ARMED, placed=True), 0.5) == Stop("placed")
    assert desk.see(replace(ARMED, placed=True), 0.5) is None
    assert (desk.shown()["phase"], desk.shown("participant")["console"]) == ("stopping", None)
    desk.close()
    assert (desk.room.busy, desk.shown()["trials_done"], desk.rows) == (False, 1, [(1, 1, "complete", None)])
    assert desk.study.journal.progress(1).attempts[-1].success


def test_a_trial_has_its_time_from_when_the_arm_is_armed(desk: Desk) -> None:
    desk.come()
    desk.begin()
    desk.see(UP)
    assert desk.turn(500.0) is None
    desk.see(ARMED)
    assert desk.turn(44.9) is None
    assert desk.turn(0.1) == Stop("time limit")
    assert desk.turn(0.1) is None
    desk.close()
    assert desk.rows == [(1, 1, "complete", None)]
    assert desk.study.journal.progress(1).attempts[-1].success is False
    assert [one.by for one in desk.study.journal.events if isinstance(one, Ended)][-1] == "limit"


def test_the_experimenter_ends_a_trial(desk: Desk) -> None:
    desk.come()
    with pytest.raises(ValueError, match="end: no trial runs"):
        desk.tell("end")
    desk.begin()
    desk.see(ARMED)
    assert desk.tell("end") == Stop("experimenter")
    with pytest.raises(ValueError, match="end: no trial runs"):
        desk.tell("end")
    desk.close()
    desk.place()
    assert desk.rows == [(1, 1, "complete", "ended by the experimenter"), (2, 1, "complete", None)]
    assert [one.by for one in desk.study.journal.events if isinstance(one, Ended)][-2:] == ["experimenter", "placed"]


def test_a_trial_in_which_the_arm_was_never_armed_is_a_fault(desk: Desk) -> None:
    desk.come()
    desk.begin()
    desk.see(UP)
    assert desk.tell("end") == Stop("experimenter")
    desk.close()
    desk.place()
    assert desk.rows == [(1, 1, "fault", "the arm was never armed"), (1, 2, "complete", None)]


def test_what_is_lost_is_a_fault_and_what_comes_back_is_none(desk: Desk) -> None:
    desk.come()
    desk.begin()
    assert desk.see(replace(ARMED, failed="the robot side was lost")) == Stop("fault")
    assert desk.room.busy
    desk.close("the recorder was lost")
    desk.begin()
    away = replace(ARMED, lost="the controller was lost")
    assert [desk.see(away), desk.see(away, 2.9), desk.see(ARMED), desk.see(away), desk.see(away, 2.9)] == [None] * 5
    assert desk.see(away, 0.1) == Stop("fault")
    desk.close()
    desk.begin()
    desk.see(ARMED)
    desk.tell("end")
    desk.close("the recorder was lost")
    desk.place()
    assert desk.rows == [
        (1, 1, "fault", "the robot side was lost"),
        (1, 2, "fault", "the controller was lost"),
        (1, 3, "fault", "the recorder was lost"),
        (1, 4, "complete", None),
    ]


def test_a_fault_while_the_sides_run_waits_for_their_end(desk: Desk) -> None:
    desk.come()
    desk.begin()
    assert desk.tell("failed", reason="the phone rang") == Stop("failed")
    with pytest.raises(ValueError, match="begun: the sides of a trial run"):
        desk.tell("begun")
    with pytest.raises(ValueError, match="choose: a trial runs"):
        desk.tell("choose", participant=2)
    desk.close()
    desk.place()
    assert desk.tell("failed", reason="looked away") is None
    desk.begin()
    assert desk.rows == [
        (1, 1, "fault", "the phone rang"),
        (1, 2, "fault", "looked away"),
        (1, 3, "fault", "interrupted"),
    ]


def test_ready_begins_a_trial_if_the_experimenter_said_so(desk: Desk) -> None:
    desk.come()
    assert desk.say("participant", "ready") is None
    assert desk.shown()["ready"]
    assert isinstance(desk.tell("at_once", value=True), Start)
    assert not desk.shown()["ready"]
    with pytest.raises(ValueError, match="ready does not come now"):
        desk.say("participant", "ready")
    desk.tell("failed", reason="x")
    desk.close()
    assert isinstance(desk.say("participant", "ready"), Start)


@pytest.mark.parametrize(
    ("page", "event"), [("participant", "begun"), ("participant", "withdrew"), ("experimenter", "rested")]
)
def test_each_page_says_its_own(desk: Desk, page: Page, event: str) -> None:
    desk.come()
    with pytest.raises(ValueError, match=f"event '{event}'; valid: "):
        desk.say(page, event)


@pytest.mark.parametrize("number", [0, 1000, True, "1", None])
def test_participants_have_numbers(desk: Desk, number: object) -> None:
    with pytest.raises(ValueError, match="valid: a number from 1 to 999"):
        desk.tell("choose", participant=number)
    with pytest.raises(ValueError, match="nobody is here; valid: choose"):
        desk.tell("begun")


def test_who_withdraws_in_a_trial_stops_the_sides_and_the_next_may_come(desk: Desk) -> None:
    desk.come()
    desk.begin()
    desk.see(ARMED)
    assert desk.tell("withdrew", reason="felt sick") == Stop("withdrew")
    assert desk.shown("participant")["console"] is None
    desk.close()
    assert (desk.room.busy, desk.rows) == (False, [])
    assert desk.shown()["proposed"] == 2
    desk.come(2)
    desk.place()
    assert [(row["number"], row["step"], row["trials_done"]) for row in desk.shown()["participants"]] == [
        (1, "withdrawn", 0),
        (2, "trial", 1),
    ]


@pytest.mark.parametrize("failed", [None, "the robot side was lost"])
def test_a_full_disk_holds_the_study_until_there_is_room(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, failed: str | None
) -> None:
    desk.come()
    desk.begin()
    desk.see(replace(ARMED, failed=failed, placed=True))
    desk.see(replace(ARMED, failed=failed, placed=True), 1.0)

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        desk.close()
        for _ in range(3):
            assert desk.turn(1.0) is None
        assert (desk.shown()["phase"], desk.room.busy) == ("saving", True)
        assert "No space left on device" in desk.shown()["trouble"]
        with pytest.raises(FeelaheadError, match="No space left"):
            desk.tell("paused")
    desk.turn(1.0)
    assert (desk.room.busy, desk.shown()["trouble"]) == (False, None)
    assert desk.rows == [(1, 1, "complete" if failed is None else "fault", failed)]


@pytest.mark.parametrize(("event", "broken"), [("withdrew", "fsync"), ("withdrew", "unlink"), ("failed", "fsync")])
def test_the_sides_stop_even_if_what_ends_the_trial_cannot_be_written(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, event: str, broken: str
) -> None:
    desk.come()
    desk.begin()
    desk.see(ARMED)

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(f"os.{broken}", full)
        assert desk.tell(event, reason="Anna felt sick") == Stop(event)
        assert desk.shown("participant")["console"] is None
        desk.close()
        assert [desk.turn(1.0), desk.turn(1.0)] == [None] * 2
        assert desk.room.busy == (broken == "fsync")
        assert "No space left on device" in desk.shown()["trouble"]
    desk.turn(1.0)
    desk.tell("choose", participant=2)
    desk.tell("enrolled")
    assert desk.rows == ([] if event == "withdrew" else [(1, 1, "fault", "Anna felt sick")])
    assert (b"Anna" in (desk.study.folder / JOURNAL).read_bytes()) == (event == "failed")
    assert any((desk.study.folder / TRIALS).glob("*p01-*")) == (event == "failed")


def test_a_killed_study_goes_on_with_who_was_there(desk: Desk) -> None:
    assert desk.shown()["step"] == "choose"
    assert Desk(desk.study, 7).shown()["participant"] == 7
    desk.come(3)
    desk.begin()
    again = Desk(desk.study)
    assert (again.shown()["participant"], again.shown()["attempt"], again.room.busy) == (3, 2, False)
    again.place()
    assert again.rows == [(1, 1, "fault", "interrupted"), (1, 2, "complete", None)]
    again.tell("withdrew")
    assert Desk(desk.study).shown()["step"] == "choose"


def test_the_minutes_left_fall_to_none(desk: Desk) -> None:
    desk.tell("choose", participant=1)
    desk.tell("enrolled")
    desk.tell("consented")
    left = [desk.shown()["minutes_left"]]
    while (step := desk.shown()["step"]) != "done":
        if step == "rest":
            desk.now_s += 60.0
            desk.say("participant", "rested")
        elif step == "questions":
            asked = desk.shown("participant")["asked"]
            values = {one["name"]: one["values"][0] for one in asked}
            desk.say("participant", "answered", block=desk.shown()["block"], values=values)
        else:
            desk.place()
        left.append(desk.shown()["minutes_left"])
    assert left[0] == pytest.approx(sum(most_minutes(desk.study.protocol).values()))
    assert left == sorted(left, reverse=True)
    assert left[-1] == 0.0
