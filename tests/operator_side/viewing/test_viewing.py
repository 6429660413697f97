import math
from collections import deque
from typing import cast

import msgspec
import pytest

from common.command.status import Status
from common.protocol.codec import decode, decode_view, encode
from common.protocol.compact import STEP_M
from common.protocol.messages import StiffnessUpdate, TriggerField, Watch
from common.protocol.view_messages import SCENE_TOPIC, VIDEO_TOPIC, SceneState
from common.reaction import HORIZON_S
from common.status.codes import InputSource
from operator_side.controller.feel import SENSED_TRAVEL
from operator_side.controller.state import Button
from operator_side.hands.travel_calibration import TriggerTravel
from operator_side.settings import OperatorSettings
from operator_side.viewing.console.console import Console, PageWords
from operator_side.viewing.facts import OperatorFacts
from operator_side.viewing.facts_of_core import Surroundings, operator_facts
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.viewing import SceneFigures, Viewing, view_topics
from tests.operator_side.console_feed import shapes, state
from tests.operator_side.operator_bench import Bench

FULL_M_S, A_M_S2, DISPLACED_M = 0.25, 2.0, 0.03


def field(first_m: float, displacement_m: float, stiffness: float) -> TriggerField:
    ways = tuple(first_m + 0.005 * step for step in range(8))
    return TriggerField(ways, ways, FULL_M_S, A_M_S2, displacement_m, stiffness)  # type: ignore[arg-type]


def facts_of(bench: Bench, surroundings: Surroundings | None = None) -> OperatorFacts:
    facts = operator_facts(
        bench.side, bench.side.status(bench.now_s), surroundings or Surroundings(InputSource.CONTROLLER), bench.now_s
    )
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(facts), type=OperatorFacts) == facts
    return facts


def felt_bench(*, swap_sides: bool = False, l2: float = 0.0, r2: float = 0.0) -> Bench:
    """Return a bench that has received stiffness for an arm at rest; the robot side compensates the delay."""
    bench = Bench(compensation="robot", swap_sides=swap_sides)
    bench.hands(Button.L1, l2=l2, r2=r2)
    bench.feel_field(
        StiffnessUpdate(
            bench.robot.stamp(bench.now_s),
            l2=field(0.2, -DISPLACED_M, 0.25),
            r2=field(0.04, DISPLACED_M, 0.75),
            speed_m_s=0.0,
            horizon_m=0.5,
            rumble=0.5,
            state="armed",
        )
    )
    return bench


def test_before_anything_has_come_nothing_is_invented() -> None:
    facts = facts_of(Bench())
    assert (facts.r2.travel, facts.r2.raw, facts.r2.course_stiffness, facts.r2.needed_m) == (None,) * 4
    assert (facts.r2.fast_m, facts.r2.zones, facts.r2.meets, facts.r2.free) == ((), (0,) * 10, 0, 1.0)
    assert (facts.field_age_ms, facts.round_trip_ms) == (None, None)


def test_each_trigger_is_told_as_it_is_written_and_where_the_finger_is() -> None:
    bench = felt_bench(r2=0.8)
    facts = facts_of(bench)
    assert (facts.r2.raw, facts.r2.travel) == pytest.approx((0.8, TriggerTravel().travel(0.8)), abs=0.01)
    assert facts.r2.zones == bench.side.haptics.written.r2
    first = next(zone for zone, strength in enumerate(facts.r2.zones) if strength)
    assert first > 0
    assert facts.r2.free == pytest.approx(TriggerTravel().travel(first / 10 / SENSED_TRAVEL))
    assert facts.r2.meets == facts.r2.zones[int(10 * SENSED_TRAVEL * 0.8)]
    assert (facts.l2.course_stiffness, facts.r2.course_stiffness, facts.r2.fast_m[0]) == (
        0.25,
        0.75,
        math.floor(0.04 / STEP_M) * STEP_M,
    )
    assert facts.rumble == pytest.approx(0.5, abs=0.01)
    assert (facts.field_age_ms, facts.advancing) == (0.0, "R2")


def test_what_is_needed_is_d_at_the_present_travel_by_the_controllers_own_names() -> None:
    facts = facts_of(felt_bench(r2=1.0))
    assert facts.r2.needed_m == pytest.approx(DISPLACED_M + FULL_M_S * HORIZON_S + FULL_M_S**2 / (2 * A_M_S2))
    assert facts.l2.needed_m == pytest.approx(-DISPLACED_M)
    swapped = facts_of(felt_bench(l2=1.0, swap_sides=True))
    assert (swapped.advancing, swapped.l2, swapped.r2) == ("L2", facts.r2, facts.l2)


def test_delays_are_those_of_the_last_second() -> None:
    bench = felt_bench()
    facts = facts_of(bench, Surroundings(InputSource.PERSON, asked_to_robot="delay 5ms"))
    assert facts.offset_s == 0.0
    assert (facts.to_robot.asked, facts.hands) == ("delay 5ms", "person")
    bench.side.link.recent.clear()
    for number in range(100):
        bench.side.link.recent.append((bench.now_s - 1.5 + 0.01 * number, 9.9, None))
    for number in range(100):
        bench.side.link.recent.append((bench.now_s, 0.001 * number, 0.2))
    facts = facts_of(bench)
    there, back = facts.to_operator, facts.to_robot
    assert back.mean_ms == pytest.approx(200.0 - 49.5)
    assert there.p99_ms == pytest.approx(9900.0)
    assert there.newest_ms == pytest.approx(99.0)
    bench.now_s += 1.1
    assert facts_of(bench).to_operator.mean_ms is None
    # If the one-way delay is unknown, half of the round trip is used.
    bench.side.link.recent.append((bench.now_s, None, 0.2))
    facts = facts_of(bench)
    assert facts.to_operator.mean_ms is None
    assert facts.to_robot.mean_ms == pytest.approx(100.0)


class FakeConsole:
    """Stand-in for the console, whose pages and messages the test sets."""

    def __init__(self) -> None:
        self.pages = 0
        self.address: str | None = None
        self.gone = False
        self.late: tuple[float, float] | None = None
        self.notes: list[str] = []
        self.shown: list[OperatorFacts] = []
        self.views: list[tuple[bytes, bool]] = []
        self.commanded: list[str] = []
        self.lacks: tuple[int, int] | None = None
        self.words: deque[PageWords] = deque()

    def receive(self, now_s: float) -> None: ...

    def take_notes(self) -> list[str]:
        return [self.notes.pop() for _ in range(len(self.notes))]

    def facts(self, facts: OperatorFacts) -> None:
        self.shown.append(facts)

    def view(self, payload: bytes, *, video: bool) -> None:
        self.views.append((payload, video))

    def note(self, text: str) -> None:
        self.commanded.append(text)


def surroundings(now_s: float) -> Surroundings:
    del now_s
    return Surroundings(InputSource.PERSON)


class Looking:
    """Operator side with a fake console, and a turn of the loop every 4 ms."""

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


def test_four_times_a_second_it_is_asked_for_and_thirty_times_shown() -> None:
    looking = Looking()
    looking.console.pages = 2
    watched = looking.turns(10.0)
    assert 38 <= len(watched) <= 41
    assert all(watch.overview and watch.first_person and watch.scene for watch in watched)
    assert 295 <= len(looking.console.shown) <= 301
    looking.console.pages = 0
    assert looking.turns(1.0) == []
    # After a pause, facts continue at their rate, without making up for missed ones.
    before, looking.console.pages = len(looking.console.shown), 1
    looking.turns(1.0)
    assert 29 <= len(looking.console.shown) - before <= 31


def test_a_late_page_asks_for_fewer_and_smaller_pictures() -> None:
    looking = Looking()
    looking.console.pages, looking.console.late = 1, (0.4, 0.0)
    assert looking.turns(10.0)[-1].picture_hz == 5.0
    looking.console.late = 0.01, 0.0
    assert (looking.turns(40.0)[-1].picture_hz, looking.turns(1.0)[-1].halved) == (None, False)


def test_a_picture_that_is_lacking_is_asked_for_at_once_and_then_four_times_a_second() -> None:
    looking = Looking()
    looking.console.pages = 1
    assert {watch.lacks for watch in looking.turns(1.0)} == {None}
    looking.console.lacks = (0, 0)
    looking.turns(0.3)
    looking.console.lacks = (0, 7)
    assert [watch.lacks for watch in looking.turns(0.012)] == [(0, 7)]
    looking.console.lacks = (0, 8)
    assert 3 <= len(looking.turns(1.0)) <= 5
    looking.console.lacks = (0, 0)
    looking.turns(0.3)
    looking.console.lacks = (9, 0)
    assert [watch.lacks for watch in looking.turns(0.012)] == [(9, 0)]


def test_pictures_and_scenes_go_to_the_console_and_the_rest_to_the_core() -> None:
    looking = Looking()
    assert looking.viewing.receive(VIDEO_TOPIC, b"a picture", 1.0)
    assert looking.viewing.receive(SCENE_TOPIC, b"a scene", 1.0)
    assert not looking.viewing.receive(b"telemetry", b"a view", 1.0)
    assert looking.console.views == [(b"a picture", True), (b"a scene", False)]


def test_without_a_console_nothing_is_asked_for_and_pictures_are_passed_over() -> None:
    bench = Bench()
    viewing = Viewing(bench.side, surroundings, Status("none", "test"), DrivingPage(), None)
    assert viewing.requests(1.0) == []
    assert not viewing.facts_due(1.0)
    assert viewing.receive(VIDEO_TOPIC, b"a picture", 1.0)
    assert view_topics(OperatorSettings()) == (b"telemetry",)
    assert set(view_topics(OperatorSettings(console=True))) == {b"telemetry", VIDEO_TOPIC, SCENE_TOPIC}


def test_messages_of_pages_reach_their_listeners() -> None:
    looking = Looking()
    looking.console.words.append((3, {"hands": {"page": "ours", "number": 1, "driving": True}}))
    looking.console.words.append((3, {"tune": {"probability": 0.9}}))
    looking.turns(0.02)
    pages = looking.viewing._pages
    assert pages.driver == "ours"
    assert [wish.probability for wish in pages.wishes] == [0.9]
    looking.console.words.append((3, None))
    looking.turns(0.02)
    assert pages.driver is None


def test_overlaps_of_the_trigger_with_more_and_ticks_are_read_from_the_newest_scene() -> None:
    figures = SceneFigures()
    assert figures.newest is None
    scene = decode_view(state(0.0))
    assert isinstance(scene, SceneState)
    scene = msgspec.structs.replace(scene, overlaps=((0, 1e-6, 2e-6), (3, 0.5e-6, 0.0)), overruns=3, tick_p50_us=60.0)
    for commanded, overlap_mm3 in ((scene, 2000.0), (msgspec.structs.replace(scene, overlaps=()), 0.0)):
        figures.receive(encode(commanded))
        expected = (overlap_mm3, 60.0, 130.0, 3)
        # Shapes and broken payloads change nothing.
        for payload in (None, shapes(), encode(scene)[:-3], b"", b"scene"):
            if payload is not None:
                figures.receive(payload)
            assert (found := figures.newest) is not None
            assert msgspec.structs.astuple(found) == pytest.approx(expected)
