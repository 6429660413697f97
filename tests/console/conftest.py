"""One browser for all tests, and demos with a console.

The scripted person of a demo needs half a minute for the task, and then rests.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from tests.console.browser import Browser, browser
from tests.console.run import Run, running

_LINK = ("--link", "delay 20ms 2ms distribution normal")
_OUT = Path("console-pictures")


@pytest.fixture(scope="session", name="browser")
def chromium() -> Iterator[Browser]:
    """Chromium, which writes pictures to the folder console-pictures/."""
    with browser(_OUT.absolute()) as opened:
        yield opened


@pytest.fixture(scope="module")
def link(request: pytest.FixtureRequest) -> Sequence[str]:
    """Arguments by which the demo emulates a link. A test module may set its own as `LINK`."""
    return getattr(request.module, "LINK", _LINK)


@pytest.fixture(scope="module")
def demo(link: Sequence[str]) -> Iterator[Run]:
    """Demo that runs through all tests of a module."""
    with running(link) as run:
        yield run


@pytest.fixture
def fresh_demo(link: Sequence[str]) -> Iterator[Run]:
    """Demo for one test, whose scripted person has just begun the task."""
    with running(link) as run:
        yield run
