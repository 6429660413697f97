"""Pictures of the console's page in a real browser, as a person sees it during `make demo`."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from PIL import Image

from tests.console.browser import LARGE, SMALL, Page, browser
from tests.console.run import DRAWN, Run, running
from tests.console.states import states
from tests.console.test_hands import is_armed, pull, take_over

SIZES: Final = (SMALL, LARGE, (640, 800), (640, 360))
"""The last is SMALL at 200 % zoom."""
_MEETS: Final = "parseInt(document.querySelector('#r2 .meets').textContent.match(/[0-9]+/)[0])"
_FRESH: Final = f"{DRAWN} && document.querySelector('.view:not([data-age=fresh])') === null"
_CALM_S: Final = 1.0


def make_first_minute(folder: Path, paths: Sequence[Path]) -> None:
    """Write five PNG of 1280x720: page opened; near the target; carrying; driven from the page; stopped."""
    opened, near, carrying, driving, stopped = paths
    with browser(folder) as one, running(()) as run, one.page(run.address, scene=True) as page:
        _settle(page)
        _keep(page, folder, opened)
        _keep_stiffest(page, run, folder, near)
        run.wait_until("carrying", lambda run: _doing(run) == "carrying", 60.0)
        _keep(page, folder, carrying)
    with browser(folder) as one, running(()) as run, one.page(run.address) as page:
        run.wait_until("advancing", lambda run: _doing(run) == "advancing", 60.0)
        take_over(page, run)
        with page.held("Space"):
            page.wait_for_text("#hands_state", "You drive", 15.0)
            with page.held("KeyW"):
                run.wait_until("pulled", lambda run: pull(run) > 0.2, 5.0)
                _keep(page, folder, driving)
        page.press("Escape")
        run.wait_until("stopped", lambda run: not is_armed(run), 5.0)
        page.wait("document.body.dataset.state == 'stopped'", "shown as stopped", 5.0)
        _keep(page, folder, stopped)


def make_states(folder: Path, paths: Sequence[Path]) -> None:
    """Write a PNG of each state in each size. The content is made up, so that every state can be had at once."""
    del folder
    to_make = iter(paths)
    with browser(paths[0].parent) as one:
        for _, page in states(one):
            for width, height in SIZES:
                page.raw.set_viewport_size({"width": width, "height": height})
                time.sleep(_CALM_S)
                page.raw.evaluate("scrollTo(0, 0)")
                next(to_make).write_bytes(page.shot())


def _settle(page: Page) -> None:
    """Take over from the scripted person until all is drawn, then let the person continue.

    Without a graphics processor the drawing takes long.
    """
    page.wait("document.querySelector('#drive:enabled') !== null", "a button to drive by", 60.0)
    page.ask("document.querySelector('#drive').click()")
    page.wait("!document.querySelector('#give_back').hidden", "the person's hands off", 60.0)
    if page.ask("document.querySelector('#drawn').ariaPressed") == "true":
        page.wait("!document.querySelector('#scene iframe').hidden", "a scene", 60.0)
    calm_since_s = began_s = time.monotonic()
    while time.monotonic() - calm_since_s < _CALM_S:
        assert time.monotonic() - began_s < 60.0
        if not page.ask(_FRESH):
            calm_since_s = time.monotonic()
        time.sleep(0.1)
    page.ask("document.querySelector('#give_back').click()")


def _keep_stiffest(page: Page, run: Run, folder: Path, path: Path) -> None:
    """Write the picture, taken during the approach, in which R2 resists most.

    Pictures take too long to wait for a given resistance.
    """
    most = 0
    run.wait_until("near", lambda run: max(run.facts[-1]["r2"]["zones"]) > 0, 60.0)
    while _doing(run) in ("advancing", "grasping"):
        meets = int(page.ask(_MEETS))
        if meets > most:
            most = meets
            _keep(page, folder, path)
        run.look()
    assert most >= 1


def _doing(run: Run) -> str:
    return str(run.status["person"])


def _keep(page: Page, folder: Path, path: Path) -> None:
    """Write a picture of the present page, reduced to 256 colours."""
    page.picture(path.stem)
    with Image.open(folder / path.name) as whole:
        whole.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)
