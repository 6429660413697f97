"""The table of faults: its rows register here, and each one says what came of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeVar


@dataclass(frozen=True)
class Outcome:
    """Findings of one row."""

    safe: bool
    """Whether the robot behaved as it must; no timing of this machine is in it."""
    measured: str
    in_time: bool = True
    """Whether the times hold, too; on a busy machine they may not."""
    judged: bool = True
    """False when the machine did not let it come so far."""

    @property
    def verdict(self) -> str:
        """Give one word for people; not judged is no success either."""
        if not self.judged:
            return "not judged"
        if not self.safe:
            return "UNSAFE"
        return "holds" if self.in_time else "safe, but late"


class Fault(NamedTuple):
    """One row of the table."""

    name: str
    safe_behaviour: str
    number: str
    """The number to hold."""
    run: Callable[..., Outcome]
    share: float = 0.0
    """Part of the repetitions, of rows that real processes try."""


Run = TypeVar("Run", bound=Callable[..., Outcome])
VIRTUAL: Final[dict[str, Fault]] = {}
"""Rows that virtual time decides, exactly, by name; called without arguments."""
REAL: Final[dict[str, Fault]] = {}
"""Rows of real processes, by name; called with the number of repetitions."""


def virtual(name: str, safe_behaviour: str, number: str) -> Callable[[Run], Run]:
    """Register a row that needs no process."""
    return _registering(VIRTUAL, name, safe_behaviour, number)


def real(name: str, safe_behaviour: str, number: str, share: float = 0.0) -> Callable[[Run], Run]:
    """Register a row of real processes."""
    return _registering(REAL, name, safe_behaviour, number, share)


def _registering(
    table: dict[str, Fault], name: str, safe_behaviour: str, number: str, share: float = 0.0
) -> Callable[[Run], Run]:
    def register(run: Run) -> Run:
        table[name] = Fault(name, safe_behaviour, number, run, share)
        return run

    return register
