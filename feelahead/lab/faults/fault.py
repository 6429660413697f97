"""The rows of the table of faults: each registers here, and says what came of it."""

from collections.abc import Callable
from typing import Final, NamedTuple


class Outcome(NamedTuple):
    """Findings of one row."""

    safe: bool
    """Whether the robot behaved as it must."""
    measured: str


FAULTS: Final[dict[str, Callable[[], Outcome]]] = {}
"""Rows by the fault."""


def fault(name: str) -> Callable[[Callable[[], Outcome]], Callable[[], Outcome]]:
    """Register a row."""

    def register(run: Callable[[], Outcome]) -> Callable[[], Outcome]:
        FAULTS[name] = run
        return run

    return register
