"""One browser for all, and demos with a console: their person needs half a minute for the task, then rests."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from tests.console.browser import Browser, browser
from tests.console.run import Run, running

_LINK = ("--link", "delay 20ms 2ms distribution normal")
_OUT = Path("console-pictures")


@pytest.fixture(scope="session", name="browser")
def chromium() -> Iterator[Browser]:
    """Chromium; its pictures go to console-pictures/."""
    with browser(_OUT.absolute()) as opened:
        yield opened


@pytest.fixture(scope="module")
def link(request: pytest.FixtureRequest) -> Sequence[str]:
    """Arguments of the demos: a module without a link has `LINK = ()`."""
    return getattr(request.module, "LINK", _LINK)


@pytest.fixture(scope="module")
def demo(link: Sequence[str]) -> Iterator[Run]:
    """One demo for a whole module."""
    with running(link) as run:
        yield run


@pytest.fixture
def fresh_demo(link: Sequence[str]) -> Iterator[Run]:
    """Demo whose person has just begun."""
    with running(link) as run:
        yield run
