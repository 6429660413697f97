"""What comes next for a participant, and what of it people in the room may see."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from feelahead.study.questionnaires import Question
from feelahead.study.schedule import Planned


@dataclass(frozen=True)
class Enrol:
    """The participant is to get the number."""


@dataclass(frozen=True)
class Consent:
    """The participant is to be told what happens, and to sign."""


@dataclass(frozen=True)
class _Attempt:
    planned: Planned
    """Cell and seed; the block of practice is 0"""
    attempt: int
    """1; more after a fault"""
    of: int
    """Number of the last trial; of practice, at most"""


@dataclass(frozen=True)
class Practice(_Attempt):
    """A try that counts for nothing."""


@dataclass(frozen=True)
class Trial(_Attempt):
    """A trial of the plan."""


@dataclass(frozen=True)
class Questions:
    """The questions after a block are to be answered."""

    block: int
    asked: tuple[Question, ...]


@dataclass(frozen=True)
class Rest:
    """The participant is to rest."""

    after: int
    """Number of trials done"""
    seconds: float


@dataclass(frozen=True)
class Pause:
    """The experimenter has paused."""


@dataclass(frozen=True)
class Done:
    """The participant has done everything."""


@dataclass(frozen=True)
class Withdrawn:
    """The participant takes part no longer."""


Step = Enrol | Consent | Practice | Trial | Questions | Rest | Pause | Done | Withdrawn


def public(step: Step) -> Mapping[str, Any]:
    """Return what the pages may show; of a trial only its number, as all else would hint at the condition."""
    name = {"step": type(step).__name__.lower()}
    if isinstance(step, _Attempt):
        return name | {"number": step.planned.number, "attempt": step.attempt, "of": step.of}
    return name | asdict(step)
