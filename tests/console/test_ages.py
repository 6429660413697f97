"""Amber, dead, hands off, stop and reset, as the page shows them: the operator side's facts are given."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import msgspec
import pytest

from common.clock import MonotonicClock
from common.protocol.view_messages import VIEW_NAMES
from common.status.codes import Hands
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts import HandsFacts, PictureFacts
from tests.console.browser import Browser, Page
from tests.console.hands_alone import hands_alone
from tests.helpers.machines.waiting import wait_until
from tests.operator_side.console_feed import Pictures, facts

pytestmark = [pytest.mark.console, pytest.mark.processes]
_OLD_S = 30.0
"""Limit of age: no machine is as slow as that"""
_AGE: str = "document.querySelector('#overview').dataset.age"


@dataclass
class Fed:
    """Facts and pictures of a console, fed in a thread; a test changes them."""

    age_s: float = 0.0
    sends: bool = True
    """Whether pictures come"""
    page: HandsFacts = field(default_factory=lambda: HandsFacts(True, "page", False, "", None))
    pictures: PictureFacts = field(default_factory=lambda: PictureFacts((_OLD_S,) * 2, (_OLD_S,) * 2))
    address: str | None = None
    ends: threading.Event = field(default_factory=threading.Event)

    def feed(self) -> None:
        clock, pictures, step = MonotonicClock(), Pictures(), 0
        with Console("test") as console:
            while not self.ends.wait(0.05):
                console.receive()
                self.address, now_s, step = console.address, clock.now(), step + 1
                told: dict[str, Any] = {"hands": Hands.BROWSER, "page": self.page, "pictures": self.pictures}
                console.facts(msgspec.structs.replace(facts(now_s), **told))
                for view in VIEW_NAMES if self.sends else ():
                    console.view(pictures.frame(view, now_s, step, now_s - self.age_s), video=True)


@contextmanager
def fed_page(browser: Browser) -> Iterator[tuple[Fed, Page]]:
    fed = Fed()
    thread = threading.Thread(target=fed.feed)
    thread.start()
    try:
        wait_until("a console's address", lambda: fed.address, 60.0)
        with browser.page(str(fed.address)) as page:
            page.wait(f"{_AGE} == 'fresh'", "fresh pictures", 30.0)
            yield fed, page
    finally:
        fed.ends.set()
        thread.join()


def test_old_pictures_are_amber_in_a_corner_and_keep_their_colours_and_dead_ones_say_so(browser: Browser) -> None:
    with fed_page(browser) as (fed, page):
        fed.age_s = 2.0
        fed.pictures = PictureFacts((0.4,) * 2, (_OLD_S,) * 2)
        page.wait(f"{_AGE} == 'old'", "amber", 30.0)
        looks = "getComputedStyle(document.querySelector('#overview {}')).{}"
        assert page.ask(looks.format(".age", "backgroundColor")) == "rgb(255, 193, 77)"
        assert page.ask(looks.format("canvas", "filter + getComputedStyle(document.body).opacity")) == "none1"
        assert not page.raw.is_visible("#overview .dead")
        page.picture("pictures-old")
        fed.sends, fed.pictures = False, PictureFacts((_OLD_S,) * 2, (0.5,) * 2)
        page.wait_for_text("#overview .dead", "NO NEW PICTURE for 2", 30.0)
        assert page.ask(_AGE) == "dead"
        assert page.raw.is_visible("#overview .dead")
        page.picture("pictures-dead")


def test_the_border_says_that_hands_are_off_until_they_count_again(browser: Browser) -> None:
    with fed_page(browser) as (fed, page):
        for counts, words in ((0.4, "hands at 40 %"), (0.0, "hands off")):
            fed.page = msgspec.structs.replace(fed.page, counts=counts)
            page.wait_for_text("#hands_off", words)
            assert page.raw.is_visible("#hands_off")
        page.picture("hands-off")
        fed.page = msgspec.structs.replace(fed.page, counts=1.0)
        page.wait("document.querySelector('#hands_off').hidden", "hands that count", 20.0)


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
