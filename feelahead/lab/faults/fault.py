"""The table of faults: its rows register here, and each one says what came of it."""

from collections.abc import Callable
from typing import Final, NamedTuple


class Outcome(NamedTuple):
    """Findings of one row."""

    safe: bool
    """Whether the robot behaved as it must."""
    measured: str


class Fault(NamedTuple):
    """One row of the table."""

    safe_behaviour: str
    number: str
    """The number to hold."""
    run: Callable[[], Outcome]


FAULTS: Final[dict[str, Fault]] = {}
"""Rows by the fault."""


def fault(name: str, safe_behaviour: str, number: str) -> Callable[[Callable[[], Outcome]], Callable[[], Outcome]]:
    """Register a row."""

    def register(run: Callable[[], Outcome]) -> Callable[[], Outcome]:
        FAULTS[name] = Fault(safe_behaviour, number, run)
        return run

    return register
