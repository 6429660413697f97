"""Whoever looks is fed, and the robot side is asked for pictures only while anybody looks."""

from collections import deque
from typing import cast

import pytest

from common.command.status import Status
from common.protocol.codec import decode
from common.protocol.messages import Watch
from common.protocol.view_messages import SCENE_TOPIC, VIDEO_TOPIC
from operator_side.console.console import Console, PageWords
from operator_side.facts import OperatorFacts
from operator_side.facts_of_core import Surroundings
from operator_side.page_hands.driving_page import DrivingPage
from operator_side.settings import OperatorSettings
from operator_side.viewing import Viewing, view_topics
from tests.operator_side.operator_bench import Bench


class FakeConsole:
    """Its pages are in the test's hands."""

    def __init__(self) -> None:
        self.pages = 0
        self.address: str | None = None
        self.notes: list[str] = []
        self.shown: list[OperatorFacts] = []
        self.views: list[tuple[bytes, bool]] = []
        self.told: list[str] = []
        self.hands: deque[PageWords] = deque()
        self.tuning: deque[PageWords] = deque()

    def receive(self) -> None: ...

    def take_notes(self) -> list[str]:
        return [self.notes.pop() for _ in range(len(self.notes))]

    def facts(self, facts: OperatorFacts) -> None:
        self.shown.append(facts)

    def view(self, payload: bytes, *, video: bool) -> None:
        self.views.append((payload, video))

    def note(self, text: str) -> None:
        self.told.append(text)


def surroundings(now_s: float) -> Surroundings:
    del now_s
    return Surroundings(hands="person")


class Looking:
    """A turn of the operator side each 4 ms."""

    def __init__(self) -> None:
        self.bench, self.console = Bench(), FakeConsole()
        status = Status("json", "test")
        console = cast(Console, self.console)
        self.viewing = Viewing(self.bench.side, surroundings, status, DrivingPage(), console)

    def turns(self, duration_s: float) -> list[Watch]:
        asked = []
        for _ in range(round(duration_s / 0.004)):
            self.bench.now_s += 0.004
            asked += [decode(payload) for payload in self.viewing.requests(self.bench.now_s)]
            if self.viewing.facts_due(self.bench.now_s):
                self.viewing.show(self.bench.side.status(self.bench.now_s), self.bench.now_s)
        assert all(isinstance(watch, Watch) for watch in asked)
        return cast(list[Watch], asked)


def test_nothing_is_asked_for_and_nothing_made_while_nobody_looks() -> None:
    looking = Looking()
    assert looking.turns(2.0) == []
    assert looking.console.shown == []


def test_four_times_a_second_it_is_asked_for_and_thirty_times_shown() -> None:
    looking = Looking()
    looking.console.pages = 2
    watched = looking.turns(10.0)
    assert 38 <= len(watched) <= 41
    assert all(watch.overview and watch.first_person and watch.scene for watch in watched)
    assert 295 <= len(looking.console.shown) <= 301
    looking.console.pages = 0
    assert looking.turns(1.0) == []
    # After a pause it goes on at its rate, instead of making up for it.
    before, looking.console.pages = len(looking.console.shown), 1
    looking.turns(1.0)
    assert 29 <= len(looking.console.shown) - before <= 31


def test_pictures_and_scenes_go_to_the_console_and_the_rest_to_the_core() -> None:
    looking = Looking()
    assert looking.viewing.take(VIDEO_TOPIC, b"a picture")
    assert looking.viewing.take(SCENE_TOPIC, b"a scene")
    assert not looking.viewing.take(b"telemetry", b"a view")
    assert looking.console.views == [(b"a picture", True), (b"a scene", False)]


def test_without_a_console_nothing_is_asked_for_and_pictures_are_passed_over() -> None:
    bench = Bench()
    viewing = Viewing(bench.side, surroundings, Status("none", "test"), DrivingPage(), None)
    assert viewing.requests(1.0) == []
    assert not viewing.facts_due(1.0)
    assert viewing.take(VIDEO_TOPIC, b"a picture")
    assert view_topics(OperatorSettings()) == (b"telemetry",)
    assert set(view_topics(OperatorSettings(console=True))) == {b"telemetry", VIDEO_TOPIC, SCENE_TOPIC}


def test_the_address_is_said_once(capsys: pytest.CaptureFixture[str]) -> None:
    looking = Looking()
    looking.console.address = "http://127.0.0.1:1/x/"
    with looking.viewing._status:
        looking.turns(0.1)
    assert capsys.readouterr().out == '{"event": "console", "address": "http://127.0.0.1:1/x/"}\n'


def test_notes_go_to_the_line_and_to_the_page() -> None:
    looking = Looking()
    looking.viewing.note("a note")
    assert looking.console.told == ["a note"]


def test_what_pages_say_reaches_whoever_follows_them() -> None:
    looking = Looking()
    looking.console.hands.append(PageWords(page=3, hands={"page": "ours", "number": 1, "driving": True}))
    looking.console.tuning.append(PageWords(page=3, tune={"probability": 0.9}))
    looking.turns(0.02)
    pages = looking.viewing._pages
    assert pages.driver == "ours"
    assert (wish := pages.take_wish()) is not None
    assert wish.probability == 0.9
    looking.console.hands.append(PageWords(page=3))
    looking.turns(0.02)
    assert pages.driver is None
