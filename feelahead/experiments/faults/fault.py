"""What a fault is, and what came of it."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Outcome:
    """What was seen."""

    safe: bool
    """Whether the robot behaved as it must; no timing of this machine is in it."""
    measured: str
    in_time: bool = True
    """Whether the times hold, too; on a busy machine they may not."""
    judged: bool = True
    """False when the machine did not let it come so far; what came of it is safe or not all the same."""


@dataclass(frozen=True)
class Fault:
    """One row of the table of faults."""

    name: str
    safe_behaviour: str
    number: str
    """What is to hold."""
    run: Callable[[], Outcome]
