"""What a check is given, and what makes it fail."""

from collections.abc import Callable
from dataclasses import dataclass

from tests.console.browser import Browser
from tests.console.run import Run

STATE = "document.body.dataset.state"
DRAWN = "['overview', 'first_person'].every((view) => document.getElementById(view).dataset.frames > 2)"
"""Both cameras' pictures have come."""


@dataclass(frozen=True)
class Stage:
    """A run and a browser."""

    run: Run
    browser: Browser


Check = Callable[[Stage], str]
"""Gives a line about what was seen; CheckFailedError where it is not what was to be seen."""
