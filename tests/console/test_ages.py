"""Amber, dead, hands off, stop and reset, as the page shows them: the operator side's facts are given."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

import msgspec
import pytest

from common.status.codes import Doing
from operator_side.viewing.facts import PictureState
from tests.console.browser import Browser, Page
from tests.console.fed_page import AGE, FRESH, Fed, fed_page
from tests.console.hands_alone import hands_alone
from tests.helpers.machines.waiting import wait_until

pytestmark = [pytest.mark.console, pytest.mark.processes]


def test_old_pictures_are_amber_in_a_corner_and_keep_their_colours_and_dead_ones_say_so(browser: Browser) -> None:
    with fed_page(browser) as (fed, page):
        fed.age_s = 2.0
        fed.pictures = msgspec.structs.replace(FRESH, states=(PictureState.OLD,) * 2)
        page.wait(f"{AGE} == 'old'", "amber")
        looks = "getComputedStyle(document.querySelector('#overview {}')).{}"
        assert page.ask(looks.format(".age", "backgroundColor")) == "rgb(255, 193, 77)"
        assert page.ask(looks.format("canvas", "filter + getComputedStyle(document.body).opacity")) == "none1"
        assert not page.raw.is_visible("#overview .dead")
        page.picture("pictures-old")
        fed.sends, fed.pictures = False, msgspec.structs.replace(FRESH, states=(PictureState.DEAD,) * 2)
        page.wait_for_text("#overview .dead", "NO NEW PICTURE for 2")
        assert page.ask(AGE) == "dead"
        assert page.raw.is_visible("#overview .dead")
        page.picture("pictures-dead")


def test_a_page_sees_itself_that_its_pictures_stand_still(browser: Browser) -> None:
    """The operator side hears only of the driving page what it shows."""
    with fed_page(browser) as (fed, page):
        page.wait(f"{AGE} == 'fresh'", "fresh")
        fed.sends, fed.pictures = False, FRESH
        page.wait_for_text("#overview .dead", "NO NEW PICTURE for")
        assert page.ask(AGE) == "dead"
        fed.sends = True
        page.wait(f"{AGE} == 'fresh'", "fresh again")


def test_the_border_says_that_hands_are_off_until_they_count_again(browser: Browser) -> None:
    with fed_page(browser) as (fed, page):
        for counts, words in ((0.4, "hands at 40 %"), (0.0, "hands off")):
            fed.page = msgspec.structs.replace(fed.page, counts=counts, because="pictures are 640 ms old")
            page.wait_for_text("#hands_off", f"{words}: pictures are 640 ms old")
            assert page.raw.is_visible("#hands_off")
        page.picture("hands-off")
        fed.page = msgspec.structs.replace(fed.page, counts=1.0)
        page.wait("document.querySelector('#hands_off').hidden", "hands that count")


@contextmanager
def driving_page(browser: Browser) -> Iterator[tuple[Fed, Page]]:
    """Yield a page that drives, with hold-to-run held, and what feeds it."""
    with fed_page(browser) as (fed, page):
        fed.page = msgspec.structs.replace(fed.page, driver=None)
        fed.state, fed.status = "disarmed", {"person": Doing.READY}
        page.raw.click("#drive")
        page.wait_for_text("#hands_state", "Ready")
        with page.held("Space"):
            wait_until("hold-to-run", lambda: fed.hands[-1]["run"])
            yield fed, page


def test_a_page_whose_drawing_is_late_is_heard_by_its_worker_and_says_how_late_it_was(browser: Browser) -> None:
    blocked = "() => { const end = performance.now() + 2000; while (performance.now() < end); }"
    with driving_page(browser) as (fed, page):
        fed.hands.clear()
        page.ask(blocked)
        page.wait_for_text("#hands_state", "This page was late by")
        wait_until("a release", lambda: not fed.hands[-1]["run"])
        repeated = [one for one in fed.hands if one["age_s"] > 0.3]
        assert repeated
        assert all(one["run"] for one in repeated)
        assert all(before["number"] < after["number"] for before, after in pairwise(fed.hands))


def test_inputs_are_older_by_what_they_waited_for_the_worker(browser: Browser) -> None:
    """A worker of its own stands for one that is held up: the page's message is a quarter of a second old."""
    late = """() => {
      const wire = new Worker("wire.js");
      wire.postMessage(new URL("live", location.href).href.replace("http", "ws"));
      wire.onmessage = ({ data }) => {
        const hands = { page: "late", driving: false, stop: false };
        if (data.open) wire.postMessage({ words: { hands }, saidMs: performance.timeOrigin + performance.now() - 250 });
      };
    }"""
    with fed_page(browser) as (fed, page):
        page.ask(late)
        wait_until("late inputs", lambda: any(one["page"] == "late" for one in list(fed.hands)))
        assert all(one["age_s"] >= 0.249 for one in fed.hands if one["page"] == "late")


def test_a_covered_window_goes_on_and_says_that_nothing_is_drawn(browser: Browser) -> None:
    with driving_page(browser) as (fed, page):
        page.ask("() => { window.requestAnimationFrame = () => 0; }")
        page.wait_for_text("#hands_state", "The browser drew nothing of this page for")
        for target in ("mug", "ball"):
            fed.status = {"target": target}
            page.wait_for_text("#target", target)


def test_after_a_stop_only_the_reset_lets_hold_to_run_count(browser: Browser) -> None:
    """By the red button and its own reset; neither a rest nor Space is one."""
    with hands_alone(browser) as alone:
        alone.run()
        assert not alone.page.raw.is_visible("#reset")
        alone.page.raw.click("#stop")
        alone.page.raw.keyboard.up("Space")
        alone.let_pass(1.5)
        alone.expect("Reset the stop first")
        alone.page.raw.keyboard.down("Space")
        alone.let_pass(0.5)
        alone.page.raw.keyboard.up("Space")
        assert (alone.state, alone.runs) == ("stopped", False)
        alone.page.raw.click("#reset")
        alone.let_pass(1.3)
        alone.expect("Ready")
        alone.page.raw.keyboard.down("Space")
        alone.let_pass(0.3)
        assert alone.state == "armed"


@pytest.mark.parametrize("after_s", [0.1, 0.6])
def test_a_stop_that_was_reset_stays_confirmed(browser: Browser, after_s: float) -> None:
    """X counts however soon it comes after STOPPED; nothing says afterwards that the stop was not confirmed."""
    with hands_alone(browser) as alone:
        alone.run()
        alone.page.raw.keyboard.press("Escape")
        alone.page.raw.keyboard.up("Space")
        alone.let_pass(after_s)
        assert alone.page.text("#hands_stopped") == "STOPPED: X resets."
        alone.page.raw.keyboard.press("KeyX")
        alone.let_pass(1.9)
        alone.expect("Ready")
        alone.page.raw.keyboard.down("Space")
        alone.let_pass(0.2)
        assert (alone.state, alone.page.text("#hands_stopped")) == ("armed", "")
        assert [message["hands"]["reset"] for message in alone.messages[-50:]] == [False] * 50


def test_a_state_from_before_the_stop_does_not_confirm_it(browser: Browser) -> None:
    with hands_alone(browser) as alone:
        status = {"state": "stopped", "link": "up", "owner": "armed"}
        alone.facts = {"status": status, "round_trip_ms": 400.0}
        alone.page.raw.keyboard.press("Escape")
        alone.let_pass(0.3)
        assert alone.messages[-1]["hands"]["stop"]
        alone.let_pass(0.2)
        assert not alone.messages[-1]["hands"]["stop"]
