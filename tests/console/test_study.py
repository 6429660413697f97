"""A study with two participants in a real browser: a reload, a full disk, killed processes, a withdrawal."""

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from feelahead.study.folder import TRIALS, read_study
from feelahead.study.questionnaires import NASA_TLX
from feelahead.study.records import answer_records, trial_records
from feelahead.study.trials.outcome import outcome_of
from tests.console.browser import Browser, Page
from tests.console.driving import Hand, OutOfTimeError, approach, grasp, place

PROTOCOL = """
name = "Small"
participants = 2
seed = 3
controller = "keyboard"
scenes = ["table"]
delays_ms = [0.0]
trials = 1
limit_s = 90.0
withdrawn = "keep"
[conditions.off]
haptics = false
[conditions.felt]
[[items]]
text = "I felt what was ahead."
[rest]
trials = 1
seconds = 3.0
"""
SIZE = (1280, 800)
TRIAL_S = 120.0
"""Longest time in which both sides start or end, on a busy machine"""
WORDS = "document.body.innerText"
EXPECTED = ("WebSocket", "ERR_", "status of 404")
"""Complaints while the study or a trial's console is away, and when a page asks whether the study is back"""
DRAWN = """[...document.querySelectorAll('.drop, .gauge, .height, .trigger, .near, .age, #charts, #scene, #tools')]
    .filter((one) => one.getClientRects().length).map((one) => one.id || one.className)"""
TELLING = ("stiff", "haptic", "swept", "law", "enlarge", " mm", "ms old", "delay", "trigger", "felt", "seed")


class Running:
    """The study's process, and what its terminal has."""

    def __init__(self, protocol: Path, folder: Path) -> None:
        command = [sys.executable, "-P", "-m", "feelahead", "study", str(protocol), "--out", str(folder)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.addresses: dict[str, str] = {}
        assert self.process.stdout is not None
        while len(self.addresses) < 2 and (line := self.process.stdout.readline()):
            if line.startswith("page of the "):
                page, _, address = line.removeprefix("page of the ").partition(": ")
                self.addresses[page] = address.strip()

    def child(self, module: str) -> int:
        """Return the process id of the side that runs `module`."""
        for path in Path("/proc").glob("[0-9]*"):
            try:
                parent = (path / "stat").read_text().rpartition(")")[2].split()[1]
                words = (path / "cmdline").read_bytes().split(b"\0")
            except OSError:
                continue
            if int(parent) == self.process.pid and module.encode() in words:
                return int(path.name)
        raise AssertionError(f"no {module} runs")

    @contextmanager
    def full_disk(self) -> Iterator[None]:
        """Let no file of the study's process grow."""
        before = resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, (1, before[1]))
        yield
        resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, before)

    def end(self, by: signal.Signals) -> int:
        self.process.send_signal(by)
        code = self.process.wait(timeout=TRIAL_S)
        if self.process.stdout is not None:
            self.process.stdout.close()
        return code


class Session:
    """Both pages, and what people do at them."""

    def __init__(self, experimenter: Page, participant: Page) -> None:
        self.experimenter, self.participant = experimenter, participant

    def step(self, words: str, limit_s: float = TRIAL_S) -> None:
        self.experimenter.wait_for_text("#step", words, limit_s)

    def begin(self) -> None:
        """Begin a trial, and wait until the participant can drive."""
        self.participant.wait("document.querySelector('#ready') !== null", "a trial to begin", TRIAL_S)
        self.participant.raw.click("#ready")
        self.experimenter.wait_for_text("#phase", "the participant is ready")
        self.experimenter.raw.click("#next")
        self.to_console()

    def to_console(self) -> None:
        self.participant.wait("document.body.classList.contains('study')", "the console", TRIAL_S)
        self.participant.wait_for_text("#hands_state", "ready", TRIAL_S)

    def end(self) -> None:
        self.experimenter.raw.click("#end")
        self.participant.wait("document.querySelector('#card') !== null", "the participant's page again", TRIAL_S)

    def rest(self) -> None:
        self.participant.wait("document.querySelector('#go_on:enabled') !== null", "the end of the rest", TRIAL_S)
        self.participant.raw.click("#go_on")

    def answer(self) -> None:
        """Answer by keyboard: each slider one to the right of the middle, of the item the first step."""
        page = self.participant
        page.wait("document.querySelector('form') !== null", "questions", TRIAL_S)
        page.raw.focus("form button.main")
        page.press("Enter")
        page.wait_for_text("#missing", f"{len(NASA_TLX) + 1} questions are still open")
        for number in range(len(NASA_TLX)):
            page.raw.focus(f"[name=q{number}]")
            page.press("ArrowRight")
        page.raw.reload()  # what was answered stays
        page.wait("document.querySelectorAll('[data-unset=false]').length == 6", "kept answers")
        page.raw.focus(f"[name=q{len(NASA_TLX)}]")
        page.press("Space")
        page.raw.focus("form button.main")
        page.picture("study-questions")
        page.press("Enter")


@contextmanager
def opened(browser: Browser, run: Running) -> Iterator[Session]:
    with (
        browser.page(run.addresses["experimenter"], SIZE) as experimenter,
        browser.page(run.addresses["participant"], SIZE) as participant,
    ):
        yield Session(experimenter, participant)
        for page in (experimenter, participant):
            assert [one for one in page.complaints if not any(words in one for words in EXPECTED)] == []
            page.complaints.clear()


def drive(page: Page) -> None:
    hand = Hand(page)
    hand.arm()
    hand.begin()
    try:
        hand.look()
        approach(hand)
        grasp(hand)
        place(hand)
    except (OutOfTimeError, AssertionError):
        pass  # a busy machine: the time limit ends the trial
    except Exception as error:
        if "navigat" not in str(error) and "null" not in str(error):
            raise
    finally:
        page.raw.keyboard.up("Space")


@pytest.mark.console
@pytest.mark.processes
def test_two_participants_with_a_reload_killed_processes_and_a_withdrawal(browser: Browser, tmp_path: Path) -> None:
    protocol, folder = tmp_path / "small.toml", tmp_path / "study"
    protocol.write_text(PROTOCOL)
    run = Running(protocol, folder)
    try:
        with opened(browser, run) as session:
            _first_participant(session, run)
            _second_participant(session)
            run.end(signal.SIGKILL)  # in a trial
            before = run.addresses
            run = Running(protocol, folder)
            assert run.addresses == before
            _after_the_kill(session)
        assert run.end(signal.SIGINT) == 0
    finally:
        if run.process.poll() is None:
            run.end(signal.SIGKILL)
    _check_data(folder)


def _first_participant(session: Session, run: Running) -> None:
    experimenter, participant = session.experimenter, session.participant
    experimenter.wait_for_text("#step", "take a participant")
    experimenter.raw.click("#choose button")
    session.step("give the participant the number")
    experimenter.raw.click("#next")
    session.step("let them sign")
    participant.wait_for_text("#card", "please wait")
    participant.picture("study-welcome")
    experimenter.raw.click("#next")
    session.step("trial 1 of 2")
    participant.wait_for_text("#card", "hold it all the time")
    participant.picture("study-instructions")
    session.begin()
    participant.raw.reload()
    session.to_console()
    with participant.held("Space", "KeyW"):
        experimenter.wait_for_text("#phase", "runs for", TRIAL_S)
        participant.picture("study-trial")
        _check_blind(participant)
    experimenter.picture("study-experimenter")
    with run.full_disk():
        session.end()
        experimenter.wait_for_text("#trouble", "not written yet", TRIAL_S)
        participant.wait_for_text("#card", "one moment")
    session.answer()
    session.rest()
    session.begin()
    os.kill(run.child("robot_side"), signal.SIGKILL)
    session.step("trial 2 of 2, attempt 2")
    assert "the robot side was lost" in experimenter.text("#faults")
    session.begin()
    _check_blind(participant)
    drive(participant)
    participant.wait("document.querySelector('form') !== null", "the end of the trial", TRIAL_S + 90.0)
    session.answer()
    session.step("all done")
    experimenter.picture("study-done")


def _check_blind(page: Page) -> None:
    """Check that nothing on a trial's page tells its condition, a distance or a delay."""
    shown = str(page.ask(WORDS)).lower()
    assert "target" in shown
    assert [word for word in TELLING if word in shown] == []
    assert page.ask(DRAWN) == []


def _second_participant(session: Session) -> None:
    experimenter = session.experimenter
    assert experimenter.raw.input_value("#number") == "2"
    experimenter.raw.click("#choose button")
    for words in ("give the participant the number", "let them sign"):
        session.step(words)
        experimenter.raw.click("#next")
    session.begin()


def _after_the_kill(session: Session) -> None:
    experimenter = session.experimenter
    experimenter.wait("document.querySelector('#lost').hidden", "the study again", TRIAL_S)
    session.step("trial 1 of 2, attempt 2")
    session.begin()
    experimenter.raw.click("#leave summary")
    experimenter.raw.fill("#withdraw input", "felt sick")
    experimenter.raw.click("#withdraw button")
    session.step("has withdrawn")
    session.participant.wait_for_text("#card", "you have ended your part", TRIAL_S)
    experimenter.wait_for_text("#facts", "not running", TRIAL_S)


def _check_data(folder: Path) -> None:
    protocol, events = read_study(folder)
    records = trial_records(protocol, events)
    rows: list[tuple[Any, ...]] = [
        (one.participant, one.trial, one.attempt, one.condition, one.status, one.excluded) for one in records
    ]
    assert rows == [
        (1, 1, 1, "off", "complete", "ended by the experimenter"),
        (1, 2, 1, "felt", "fault", "the robot side was lost"),
        (1, 2, 2, "felt", "complete", None),
        (2, 1, 1, "felt", "fault", "interrupted"),
        (2, 1, 2, "felt", "withdrawn", "withdrawn"),
    ]
    whole = [path.name for path in sorted((folder / TRIALS).iterdir()) if not path.name.startswith("unfinished-")]
    assert whole == ["p01-t001.mcap", "p01-t002-2.mcap"]
    first, second = (outcome_of(folder / TRIALS / name, protocol.limit_s) for name in whole)
    assert first is not None
    assert second is not None
    assert not first.completed
    assert first.path_m > 0.0
    ends = [one.success for one in events if hasattr(one, "success")]
    assert ends == [False, second.completed]
    answers = answer_records(protocol, events)
    names = [*(item.name for item in NASA_TLX), "I felt what was ahead."]
    assert [(one.participant, one.block, one.item, one.value) for one in answers] == [
        (1, block, name, 55.0 if name.startswith("tlx") else 1.0) for block in (1, 2) for name in names
    ]
    assert not (folder / "pages.json").exists()
