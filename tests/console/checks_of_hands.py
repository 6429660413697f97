"""The keyboard and a gamepad drive, and let go as soon as nobody means them."""

import time
from typing import Any, Final

from tests.console.browser import Page
from tests.console.run import Run
from tests.console.stage import Stage
from tests.containers.watch import check

_BUTTONS: Final = 17
_RUN: Final = 4
_PULL: Final = 7
"""L1 and R2 among a standard gamepad's buttons."""


def space_drives(stage: Stage) -> str:
    """Space held arms and runs, a pull moves, and the key that comes up lets go."""
    run = stage.run
    with stage.browser.page(run.address) as page:
        armed_s = take_over(page, run)
        with page.held("Space"):
            page.wait_for_text("#hands_state", "You drive", 15.0)
            with page.held("KeyW"):
                run.wait_until("pulled", lambda run: pull(run) > 0.1, 5.0)
                page.picture("hands")
            run.wait_until("let go", lambda run: pull(run) == 0.0, 5.0)
        took_s = run.wait_until("disarmed or at rest", lambda run: not _runs(run), 5.0)
    return f"driving {armed_s:.1f} s after the page was asked for; at rest {took_s:.2f} s after the key came up"


def hidden_or_left_page_lets_go(stage: Stage) -> str:
    """A window that loses the focus and a tab that is hidden hold nothing any more, keys down or not."""
    run, took = stage.run, []
    for leave in (Page.blur, Page.hide):
        with stage.browser.page(run.address) as page:
            take_over(page, run)
            with page.held("Space"):
                page.wait_for_text("#hands_state", "You drive", 15.0)
                with page.held("KeyW"):
                    run.wait_until("pulled", lambda run: pull(run) > 0.1, 5.0)
                    leave(page)
                    took.append(run.wait_until("let go", lambda run: pull(run) == 0.0, 5.0))
    return f"let go {took[0]:.2f} s after the focus was lost, {took[1]:.2f} s after the tab was hidden"


def gamepad_drives(stage: Stage) -> str:
    """A gamepad's trigger is a trigger."""
    run = stage.run
    with stage.browser.page(run.address, gamepad=True) as page:
        page.pretend_gamepad((0.0,) * 4, (0.0,) * _BUTTONS)
        take_over(page, run)
        held = [0.0] * _BUTTONS
        held[_RUN] = 1.0
        page.pretend_gamepad((0.0,) * 4, tuple(held))
        page.wait_for_text("#hands_state", "You drive", 15.0)
        held[_PULL] = 0.6
        page.pretend_gamepad((0.0,) * 4, tuple(held))
        run.wait_until("pulled", lambda run: pull(run) > 0.3, 5.0)
        pulled = pull(run)
        page.pretend_gamepad((0.0,) * 4, (0.0,) * _BUTTONS)
        run.wait_until("let go", lambda run: pull(run) == 0.0, 5.0)
    return f"0.6 of its trigger is {pulled:.2f} of R2"


def escape_stops(stage: Stage) -> str:
    """Esc stops whoever drives: here the scripted person, while another element of the page has the focus."""
    run = stage.run
    with stage.browser.page(run.address) as page:
        run.wait_until("armed", is_armed, 60.0)
        page.press("Tab")
        page.press("Escape")
        took_s = run.wait_until("stopped", lambda run: not is_armed(run), 5.0)
        page.wait("document.body.dataset.state != 'armed'", "shown as stopped", 5.0)
        words = page.text("#state")
        page.picture("stopped")
        check("ARMED" not in words.replace("DISARMED", ""), f"stopped is said as {words!r}")
    return f"stopped after {took_s:.2f} s, said as {words!r}"


def take_over(page: Page, run: Run) -> float:
    """The page asks to drive, and its keys rest; how long until it may."""
    page.wait("document.querySelector('#drive:enabled') !== null", "a button to drive by", 20.0)
    began_s = time.monotonic()
    page.raw.click("#drive")
    run.wait_until("the page's hands", lambda run: _newest(run)["hands"] == "browser", 10.0)
    page.wait_for_text("#hands_state", "Ready", 15.0)
    return time.monotonic() - began_s


def _newest(run: Run) -> dict[str, Any]:
    return dict(run.facts[-1])


def is_armed(run: Run) -> bool:
    """By the newest facts."""
    return run.status.get("state") == "armed"


def pull(run: Run) -> float:
    """How far R2 is pulled, as the newest facts have it."""
    return float(_newest(run)["r2"]["travel"] or 0.0)


def _runs(run: Run) -> bool:
    return is_armed(run) and _newest(run)["hands"] == "browser" and pull(run) > 0.0
