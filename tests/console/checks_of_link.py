"""A link that is lost is unmistakable, also without colours."""

import time
from typing import Any, Final

import numpy as np

from tests.console.browser import Page, border, brightness
from tests.console.stage import DRAWN, STATE, Stage
from tests.containers.watch import CheckFailedError, check

_ASKED_S: Final = 1.0
_LIMIT_S: Final = 4.0
"""A busy machine may take its time; the line says what it took."""


def frozen_robot_is_unmistakable(stage: Stage) -> str:
    """kill -STOP of the robot side: words, border and both views say so, and it all comes back."""
    with stage.browser.page(stage.run.address) as page:
        page.wait(DRAWN, "drawn both views")
        page.wait(f"{STATE} == 'armed'", "armed", 60.0)
        before, views_before = border(page.pixels()), _fresh_view(page)
        words_before = page.text("#state")
        with stage.run.frozen("robot"):
            began_s = time.monotonic()
            page.wait(f"{STATE} == 'lost'", "shown as lost", _LIMIT_S)
            took_s = time.monotonic() - began_s
            page.wait_for_text("#link", "lost", _LIMIT_S)
            page.wait_for_text("#overview .stale", "stale", _LIMIT_S)
            page.wait_for_text("#first_person .stale", "stale", _LIMIT_S)
            all_s = time.monotonic() - began_s
            words = page.text("#state")
            lost, views_lost = border(page.pixels()), page.pixels("#overview")
            page.picture("link-lost")
        check("LOST" in words and words != words_before, f"lost is said as {words!r}")
        colour = np.abs(before.mean(axis=0) - lost.mean(axis=0)).max()
        check(colour > 40, f"the border is {before.mean(axis=0)} armed and {lost.mean(axis=0)} lost")
        # One flat brightness while armed, stripes while lost: seen by whoever sees no colours.
        flat, striped = brightness(before).std(), brightness(lost).std()
        check(flat < 10 and striped > 50, f"the border's brightness differs by {flat:.0f} armed, {striped:.0f} lost")
        greyed = np.abs(brightness(views_before) - brightness(views_lost)).mean()
        check(greyed > 5, f"the view's brightness changed by {greyed:.1f} only")
        page.wait("document.querySelector('#link').textContent == 'up'", "back", 30.0)
        page.wait("document.querySelector('#overview .stale').hidden", "fresh again", 30.0)
    return f"lost after {took_s:.2f} s, everywhere after {all_s:.2f} s (asked: {_ASKED_S:g} s); back after it goes on"


def _fresh_view(page: Page) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """The overview at a moment when it was not stale: on a busy machine it may be, now and then."""
    end_s = time.monotonic() + 60.0
    while time.monotonic() < end_s:
        page.wait("document.querySelector('#overview.old') === null", "a fresh view", 60.0)
        pixels = page.pixels("#overview")
        if page.ask("document.querySelector('#overview.old') === null"):
            return pixels
    raise CheckFailedError("the overview was stale for a minute")


def silent_operator_side_is_unmistakable(stage: Stage) -> str:
    """kill -STOP of the operator side, which feeds the console."""
    with stage.browser.page(stage.run.address) as page:
        page.wait(DRAWN, "drawn both views")
        with stage.run.frozen("operator"):
            began_s = time.monotonic()
            page.wait("!document.querySelector('#lost').hidden", "shown as silent", _LIMIT_S)
            took_s = time.monotonic() - began_s
            words = page.text("#lost")
            page.picture("operator-silent")
        check("HEARD" in words or "LOST" in words, f"silence is said as {words!r}")
        page.wait("document.querySelector('#lost').hidden", "back", 30.0)
    return f"said after {took_s:.2f} s (asked: {_ASKED_S:g} s): {words[:60]}"
