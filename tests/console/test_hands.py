"""The keyboard drives the arm in a real run, releases R2 and stops the arm; test_hands_alone.py tests all else."""

from typing import Any

import pytest

from tests.console.browser import Browser, Page
from tests.console.run import Run

LINK = ()
pytestmark = [pytest.mark.console, pytest.mark.processes, pytest.mark.quiet]


def test_space_drives(browser: Browser, demo: Run) -> None:
    """Holding Space arms the arm and lets it move. A key pulls R2, and releasing the key releases R2."""
    with browser.page(demo.address) as page:
        take_over(page, demo)
        with page.held("Space"):
            page.wait_for_text("#hands_state", "You drive")
            with page.held("KeyW"):
                demo.wait_until("pulled", lambda run: pull(run) > 0.1)
                page.picture("hands")
            demo.wait_until("let go", lambda run: pull(run) == 0.0)
        demo.wait_until("disarmed or at rest", lambda run: not _runs(run))


def test_escape_stops(browser: Browser, fresh_demo: Run) -> None:
    """Esc stops whoever drives: here the scripted person, while another element of the page has the focus."""
    with browser.page(fresh_demo.address) as page:
        fresh_demo.wait_until("armed", is_armed)
        page.press("Tab")
        page.press("Escape")
        fresh_demo.wait_until("stopped", lambda run: not is_armed(run))
        page.wait("document.body.dataset.state != 'armed'", "shown as stopped")
        words = page.text("#state")
        page.picture("stopped")
        assert "ARMED" not in words.replace("DISARMED", "")


def take_over(page: Page, run: Run) -> None:
    """Ask to drive from the page, and press no key until the page may drive."""
    page.wait("document.querySelector('#drive:enabled') !== null", "a button to drive by")
    page.raw.click("#drive")
    run.wait_until("the page's hands", lambda run: _newest(run)["hands"] == "browser")
    page.wait_for_text("#hands_state", "Ready")


def _newest(run: Run) -> dict[str, Any]:
    return dict(run.facts[-1])


def is_armed(run: Run) -> bool:
    return run.status.get("state") == "armed"


def pull(run: Run) -> float:
    return float(_newest(run)["r2"]["travel"] or 0.0)


def _runs(run: Run) -> bool:
    return is_armed(run) and _newest(run)["hands"] == "browser" and pull(run) > 0.0
