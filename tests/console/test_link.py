"""The page shows a lost link unmistakably, even to those who see no colours."""

import time
from typing import Any, Final

import numpy as np
import pytest

from tests.console.browser import Browser, Page, border, brightness
from tests.console.run import DRAWN, STATE, Run
from tests.helpers.machines.quiet import judged

pytestmark = [pytest.mark.console, pytest.mark.processes, pytest.mark.quiet]


_ASKED_S: Final = 1.0
_LIMIT_S: Final = 4.0
"""Time limit in seconds; the tests print the time taken"""


def test_frozen_robot_is_unmistakable(browser: Browser, demo: Run) -> None:
    """While the robot side's process is stopped, words, border and both views show it; then everything comes back."""
    with browser.page(demo.address) as page:
        page.wait(DRAWN, "drawn both views")
        page.wait(f"{STATE} == 'armed'", "armed")
        before, views_before = border(page.pixels()), _fresh_view(page)
        words_before = page.text("#state")
        with judged(), demo.frozen("robot"):
            began_s = time.monotonic()
            page.wait(f"{STATE} == 'lost'", "shown as lost", _LIMIT_S)
            print(f"lost after {time.monotonic() - began_s:.2f} s (asked: {_ASKED_S:g} s)")
            page.wait_for_text("#link", "lost", _LIMIT_S)
            page.wait_for_text("#overview .dead", "no new picture", _LIMIT_S)
            page.wait_for_text("#first_person .dead", "no new picture", _LIMIT_S)
            words = page.text("#state")
            lost, views_lost = border(page.pixels()), page.pixels("#overview")
            page.picture("link-lost")
        assert "LOST" in words
        assert words != words_before
        colour = np.abs(before.mean(axis=0) - lost.mean(axis=0)).max()
        assert colour > 40
        # One flat brightness while armed, stripes while lost: visible without colours, too.
        flat, striped = brightness(before).std(), brightness(lost).std()
        assert flat < 10
        assert striped > 50
        hatched = np.abs(brightness(views_before) - brightness(views_lost)).mean()
        assert hatched > 5
        page.wait("document.querySelector('#link').textContent == 'up'", "back")
        page.wait("document.querySelector('#overview .dead').hidden", "fresh again")


def _fresh_view(page: Page) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return the pixels of the overview at a time when it is not stale, as a busy machine may delay it."""
    end_s = time.monotonic() + 60.0
    while time.monotonic() < end_s:
        page.wait("document.querySelector('#overview:not([data-age=fresh])') === null", "a fresh view")
        pixels = page.pixels("#overview")
        if page.ask("document.querySelector('#overview:not([data-age=fresh])') === null"):
            return pixels
    raise AssertionError("the overview was stale for a minute")


def test_silent_operator_side_is_unmistakable(browser: Browser, demo: Run) -> None:
    """The process of the operator side, which sends the page its data, is stopped by kill -STOP."""
    with browser.page(demo.address) as page:
        page.wait(DRAWN, "drawn both views")
        with judged(), demo.frozen("operator"):
            began_s = time.monotonic()
            page.wait("!document.querySelector('#lost').hidden", "shown as silent", _LIMIT_S)
            print(f"said after {time.monotonic() - began_s:.2f} s (asked: {_ASKED_S:g} s)")
            words = page.text("#lost")
            page.picture("operator-silent")
        assert "HEARD" in words or "LOST" in words
        page.wait("document.querySelector('#lost').hidden", "back")
