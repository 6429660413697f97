import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from common.status.codes import Doing
from operator_side.viewing.pages.driving_page import REST_S, SILENCE_S, DrivingPage
from operator_side.viewing.pages.page_messages import PageHands, PageMessage
from tests.operator_side.operator_bench import Bench
from tests.operator_side.viewing.pages.talking_page import PERIOD_S, TalkingPage

NO_HANDS: list[object] = [
    None,
    {"hands": 1},
    {"hands": {"page": "", "number": 1}},
    {"hands": {"page": "a", "number": -1}},
    {"hands": {"page": "a", "number": 1, "r2": 1.01}},
    {"hands": {"page": "a", "number": 1, "r2": math.nan}},
    {"hands": {"page": "a", "number": 1, "lateral": [0.0, -1.1]}},
    {"hands": {"page": "a", "number": 1, "turning": [0.0]}},
    {"hands": {"page": "a", "number": 1, "gripper": 2}},
    {"hands": {"page": "a", "number": 1, "run": 1}},
    {"hands": {"page": "a", "number": 1, "arm": True}},
    {"tune": {"probability": 1.0}},
    {"tune": {"probability": math.nan}},
    {"tune": {"link": "x" * 201}},
    {"mark": "done"},
]


@pytest.fixture
def pages() -> DrivingPage:
    return DrivingPage()


@pytest.mark.parametrize("content", NO_HANDS, ids=str)
def test_what_is_no_message_is_refused_whole_and_counted(pages: DrivingPage, content: object) -> None:
    pages.receive(1, content, 0.0)
    assert (pages.rejected, pages.driver, len(pages.wishes)) == (1, None, 0)
    assert not pages.stopping(0.0)


def test_hold_to_run_counts_after_a_full_second_of_rest_and_until_it_is_let_go(pages: DrivingPage) -> None:
    page = TalkingPage(pages)
    now_s = page.go_on(0.0, REST_S)
    assert pages.doing is Doing.ALL_KEYS_UP_FIRST
    page.say(now_s)
    assert (pages.doing, pages.driver) == (Doing.READY, "page1")
    page.say(now_s + 0.02, run=True, r2=0.5)
    hands = pages.hands(now_s + 0.02)
    assert hands is not None
    assert (hands.run, hands.r2) == (True, 0.5)
    page.say(now_s + 0.04, r2=0.5)
    assert pages.hands(now_s + 0.04) is None
    page.say(now_s + 0.06, run=True, r2=0.5)
    assert pages.hands(now_s + 0.06) is None
    assert pages.doing is Doing.ALL_KEYS_UP_FIRST


def running(pages: DrivingPage, page: TalkingPage, start_s: float = 0.0) -> float:
    now_s = page.go_on(start_s, 1.1)
    page.say(now_s, run=True)
    assert pages.doing is Doing.RUNNING
    return now_s


def test_nobody_takes_over_from_a_page_that_drives_nor_drives_without_meaning_it(pages: DrivingPage) -> None:
    one, two = TalkingPage(pages, 1), TalkingPage(pages, 2)
    now_s = running(pages, one)
    two.say(now_s)
    assert pages.driver == "page1"
    assert pages.hands(now_s) is not None
    pages.close(1, now_s)
    assert pages.hands(now_s) is None
    two.say(now_s + 0.02)
    assert pages.driver is None  # It asked while another page drove: it must ask again.
    two.say(now_s + 0.04, driving=False)
    two.say(now_s + 0.06)
    assert pages.driver == "page2"


def test_any_page_stops_and_then_all_keys_are_up_first(pages: DrivingPage) -> None:
    one, two = TalkingPage(pages, 1), TalkingPage(pages, 2)
    now_s = running(pages, one)
    two.say(now_s, driving=False, stop=True)
    assert pages.stopping(now_s + 0.1)
    assert not pages.stopping(now_s + SILENCE_S + 0.001)
    assert pages.hands(now_s) is None
    one.say(now_s + 0.02, run=True)
    assert pages.hands(now_s + 0.02) is None


def test_hold_to_run_counts_again_only_after_a_reset_by_the_page_that_drives(pages: DrivingPage) -> None:
    one, two = TalkingPage(pages, 1), TalkingPage(pages, 2)
    now_s = one.go_on(running(pages, one), 0.1, stop=True)
    now_s = one.go_on(now_s, 2.0)
    assert (pages.doing, pages.reset_first) == (Doing.ALL_KEYS_UP_FIRST, True)
    one.say(now_s, reset=True, stop=True)  # pressed together, the stop counts
    two.say(now_s + 0.01, driving=False, reset=True)
    two.say(now_s + 0.01, driving=False, give_back=True)
    assert (pages.reset_first, pages.take_give_back()) == (True, False)
    one.say(now_s + 1.0, reset=True)
    assert pages.reset_first is False
    now_s = one.go_on(now_s + 1.02, 1.1)
    assert pages.doing is Doing.READY
    pages.require_reset()
    one.say(now_s, run=True)
    assert pages.hands(now_s) is None


def test_an_overtaken_message_counts_only_for_its_stop(pages: DrivingPage) -> None:
    page = TalkingPage(pages)
    late, late_stop = page.content(run=True, r2=1.0), page.content(stop=True)
    now_s = running(pages, page)
    pages.receive(1, late, now_s)
    hands = pages.hands(now_s)
    assert hands is not None
    assert (pages.stale, hands.r2) == (1, 0.0)
    pages.receive(1, late_stop, now_s)
    assert pages.stopping(now_s)


def test_where_a_controller_drives_no_page_does_but_any_stops() -> None:
    pages = DrivingPage(may_drive=False)
    page = TalkingPage(pages)
    now_s = page.go_on(0.0, 1.5)
    page.say(now_s, run=True)
    assert pages.driver is None
    assert pages.hands(now_s) is None
    page.say(now_s, stop=True)
    assert pages.stopping(now_s)


def test_the_person_goes_on_only_by_the_page_that_drives_or_any_when_none_does(pages: DrivingPage) -> None:
    one, two = TalkingPage(pages, 1), TalkingPage(pages, 2)
    one.say(0.0)
    two.say(0.0, driving=False, give_back=True)
    assert not pages.take_give_back()
    one.say(0.02, give_back=True)
    assert pages.take_give_back()
    assert pages.driver is None
    one.say(0.04, driving=False, give_back=True)
    assert not pages.take_give_back()  # Held, and not pressed again.
    two.say(0.06, driving=False)
    two.say(0.08, driving=False, give_back=True)
    assert pages.take_give_back()


@dataclass(frozen=True)
class Heard:
    now_s: float
    page: int
    hands: PageHands


KINDS: dict[str, dict[str, Any]] = {
    "rest": {},
    "run": {"run": True},
    "pull": {"run": True, "r2": 1.0},
    "pull only": {"l2": 0.5},
    "stick": {"run": True, "lateral": [0.0, -1.0]},
    "grip": {"gripper": 1},
    "stop": {"stop": True},
    "reset": {"reset": True},
    "look on": {"driving": False},
    "give back": {"give_back": True},
}
segments = st.lists(
    st.tuples(
        st.sampled_from([*KINDS, "rest", "rest", "run", "pull", "silence", "garbage", "close", "replay"]),
        st.sampled_from([1, 1, 1, 2]),
        st.integers(1, 60),
        st.sampled_from([PERIOD_S, 0.004, 0.1, SILENCE_S, 0.31]),
    ),
    max_size=12,
)


@settings(max_examples=300, deadline=None)
@example([("rest", 1, 55, PERIOD_S), ("pull", 1, 5, PERIOD_S), ("stop", 2, 1, PERIOD_S), ("pull", 1, 60, PERIOD_S)])
@example([("rest", 1, 55, PERIOD_S), ("pull", 1, 1, PERIOD_S), ("silence", 1, 1, 0.31), ("pull", 1, 60, PERIOD_S)])
@example([("rest", 1, 55, PERIOD_S), ("rest", 2, 55, PERIOD_S), ("pull", 1, 9, PERIOD_S), ("pull", 2, 9, PERIOD_S)])
@given(segments)
def test_hands_count_only_while_fresh_and_after_a_second_of_rest(script: list[tuple[str, int, int, float]]) -> None:
    pages = DrivingPage()
    talkers = {number: TalkingPage(pages, number) for number in (1, 2)}
    heard: list[Heard] = []
    said: dict[int, list[dict[str, Any]]] = {1: [], 2: []}
    now_s = 0.0
    for kind, number, count, period_s in script:
        for _ in range(count):
            judge(pages, heard, now_s + 0.9 * period_s)
            now_s += period_s
            if kind == "garbage":
                pages.receive(number, {"hands": {"run": True}}, now_s)
            elif kind == "close":
                pages.close(number, now_s)
            elif kind == "replay" and said[number]:
                pages.receive(number, said[number][0], now_s)
            elif kind in KINDS:
                content = talkers[number].content(**KINDS[kind])
                said[number].append(content)
                pages.receive(number, content, now_s)
                hands = msgspec.convert(content, PageMessage).hands
                assert hands is not None
                heard.append(Heard(now_s, number, hands))
            judge(pages, heard, now_s)


def judge(pages: DrivingPage, heard: list[Heard], now_s: float) -> None:
    """Assert that inputs that count are recent, and follow a second of rest of the same page without gap or stop."""
    hands = pages.hands(now_s)
    if hands is None:
        return
    [number] = {one.page for one in heard if one.hands is hands or one.hands == hands}
    ours = [one for one in heard if one.page == number]
    assert ours[-1].hands == hands
    assert now_s - ours[-1].now_s <= SILENCE_S
    began = len(ours)
    while began > 0 and ours[began - 1].hands.run and not ours[began - 1].hands.stop:
        began -= 1
    rested = began
    while rested > 0 and ours[rested - 1].hands.all_up and ours[rested - 1].hands.driving:
        if rested < len(ours) and ours[rested].now_s - ours[rested - 1].now_s > SILENCE_S:
            break
        rested -= 1
    assert all(after.now_s - before.now_s <= SILENCE_S for before, after in pairwise(ours[rested:]))
    assert ours[began].now_s - ours[rested].now_s >= REST_S
    assert not any(one.hands.stop for one in heard if one.now_s > ours[began].now_s - REST_S)


def test_unconfirmed_inputs_count_less_and_less_then_nothing_and_after_a_second_all_keys_are_up_first(
    pages: DrivingPage,
) -> None:
    """The worker of a page whose drawing is late repeats inputs. Once it draws again, they return in half a second."""
    page = TalkingPage(pages)
    start_s = running(pages, page)
    travel_s, shares = 0.0, {}
    for step in range(1, 91):
        age_s = 0.01 * step
        page.say(start_s + age_s, run=True, r2=1.0, age_s=age_s)
        assert pages.hands(start_s + age_s) is not None
        shares[step] = pages.counts
        travel_s += 0.01 * pages.counts
    assert (shares[15], shares[30], shares[90]) == pytest.approx((1.0, 0.0, 0.0))
    assert shares[22] == pytest.approx(0.08 / 0.15)
    assert travel_s == pytest.approx(0.225, abs=0.01)
    page.say(start_s + 0.92, run=True, r2=1.0)
    pages.hands(start_s + 0.92)
    assert 0.0 < pages.counts < 0.1
    assert pages.because == "this page is late by 900 ms"
    now_s = page.go_on(start_s + 0.94, 0.5, run=True)
    pages.hands(now_s)
    assert (pages.counts, pages.because) == (1.0, "")
    page.say(now_s, run=True, age_s=1.01)
    assert pages.hands(now_s) is None
    assert (pages.doing, pages.released) == (Doing.ALL_KEYS_UP_FIRST, "This page was late by 1010 ms.")
    # What is not confirmed is no rest.
    page.go_on(now_s, 1.5, age_s=0.2)
    assert pages.doing is Doing.ALL_KEYS_UP_FIRST


def test_a_frozen_page_gives_its_seat_and_its_stop_up_and_gets_none(pages: DrivingPage) -> None:
    """Its worker would repeat them for ever."""
    frozen, other = TalkingPage(pages), TalkingPage(pages, 2)
    now_s = running(pages, frozen)
    frozen.say(now_s, run=True, stop=True, age_s=0.9)
    assert pages.stopping(now_s)
    for later_s in (0.2, 0.4):
        frozen.say(now_s + later_s, run=True, stop=True, age_s=1.0 + later_s)
    assert not pages.stopping(now_s + 0.4)
    assert pages.driven(now_s + 0.4)
    frozen.say(now_s + 0.6, run=True, age_s=3.1)
    assert not pages.driven(now_s + 0.6)
    assert pages.released == "This page was late by 3100 ms."
    frozen.say(now_s + 0.7, run=True, age_s=3.2)
    assert not pages.driven(now_s + 0.7)
    other.say(now_s + 0.8, reset=True)
    assert (pages.driven(now_s + 0.8), pages.reset_first) == (True, False)


def test_a_silent_page_moves_ever_less_until_nobody_drives_which_is_said_with_the_time(pages: DrivingPage) -> None:
    start_s = running(pages, TalkingPage(pages))
    shares = []
    for age_s in (0.1, 0.225, 0.299):
        assert pages.hands(start_s + age_s) is not None
        shares.append(pages.counts)
    assert shares == pytest.approx([1.0, 0.5, 0.0], abs=0.01)
    assert pages.hands(start_s + 0.31) is None
    assert (pages.driver, pages.released) == (None, "Nothing came from this page for 310 ms.")


def test_any_page_marks_episodes() -> None:
    pages, bench = DrivingPage(may_drive=False), Bench()
    for mark in ("start", "success", "success"):
        pages.receive(1, {"mark": mark}, bench.now_s)
    pages.apply(bench.side, bench.now_s)
    assert bench.side.summary()["episodes"] == {"start": 1, "success": 1}
