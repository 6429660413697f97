"""One browser for all tests, and demos with a console.

The scripted person of a demo needs half a minute for the task, and then rests.
"""

import functools
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.console.browser import Browser, browser
from tests.console.run import Run, running


@pytest.fixture(scope="session", name="browser")
def chromium() -> Iterator[Browser]:
    with browser(Path("console-pictures").absolute()) as opened:
        yield opened


@pytest.fixture(scope="module")
def link(request: pytest.FixtureRequest) -> tuple[str, ...]:
    """Arguments by which the demo emulates a link. A test module may set its own as `LINK`."""
    return getattr(request.module, "LINK", ("--link", "delay 20ms 2ms distribution normal"))


@pytest.fixture(scope="session")
def demos() -> Iterator[Callable[[tuple[str, ...]], Run]]:
    """Function that returns the demo with these arguments, started when it is first asked for."""
    with ExitStack() as stack:
        yield functools.cache(lambda arguments: stack.enter_context(running(arguments)))


@pytest.fixture
def demo(demos: Callable[[tuple[str, ...]], Run], link: tuple[str, ...]) -> Run:
    return demos(link)


@pytest.fixture
def fresh_demo(link: tuple[str, ...]) -> Iterator[Run]:
    """Demo for one test, whose scripted person has just begun the task."""
    with running(link) as run:
        yield run
