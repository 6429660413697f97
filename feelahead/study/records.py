"""What a journal says about trials and answers, as rows of the study's tables."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

from feelahead.study.events import Begun, Event, Withdrew
from feelahead.study.progress import INTERRUPTED, Attempt, Progress, practice_plan, progress_of
from feelahead.study.protocol import Protocol
from feelahead.study.schedule import Planned, schedule


@dataclass(frozen=True)
class TrialRecord:
    """A trial that was begun: the table's columns that the journal knows."""

    participant: int
    trial: int
    attempt: int
    practice: bool
    block: int
    condition: str
    delay_ms: float
    scene: str
    repeat: int
    seed: int
    status: Literal["complete", "fault", "withdrawn"]
    excluded: str | None
    """Why it counts for nothing; None if it counts"""
    recording: str
    """Name of its recording in the folder `trials`; of a fault it may be torn or missing"""


@dataclass(frozen=True)
class AnswerRecord:
    """Row of the table of answers."""

    participant: int
    block: int
    condition: str
    item: str
    value: float


def recording_name(begun: Begun) -> str:
    """Return the name of an attempt's recording when it is whole, such as p03-t017.mcap, or p03-t017-2.mcap."""
    again = "" if begun.attempt == 1 else f"-{begun.attempt}"
    return f"p{begun.participant:02d}-{'practice' if begun.practice else 't'}{begun.trial:03d}{again}.mcap"


def participants_of(events: Iterable[Event]) -> tuple[int, ...]:
    """Return the numbers of all participants, in order."""
    return tuple(sorted({event.participant for event in events}))


def trial_records(protocol: Protocol, events: Iterable[Event]) -> tuple[TrialRecord, ...]:
    """Return a record of each trial that was begun, by participant, in the order in which they were begun.

    If the protocol removes the data of those who withdraw, they have none.
    """
    return tuple(
        _record(protocol, participant, attempt, progress)
        for participant, progress in _counted(protocol, events)
        for attempt in progress.attempts
    )


def answer_records(protocol: Protocol, events: Iterable[Event]) -> tuple[AnswerRecord, ...]:
    """Return the answers, by participant and block; of whom, as for `trial_records`."""
    return tuple(
        AnswerRecord(participant, block, _condition(protocol, participant, block), item, value)
        for participant, progress in _counted(protocol, events)
        for block, values in sorted(progress.answers.items())
        for item, value in values.items()
    )


def withdrawn(events: Iterable[Event]) -> tuple[int, ...]:
    """Return the numbers of those who withdrew, in order."""
    return participants_of(event for event in events if isinstance(event, Withdrew))


def _counted(protocol: Protocol, events: Iterable[Event]) -> Iterator[tuple[int, Progress]]:
    events = tuple(events)
    for participant in participants_of(events):
        progress = progress_of(events, participant)
        if not (progress.withdrawn and protocol.withdrawn == "remove"):
            yield participant, progress


def _record(protocol: Protocol, participant: int, attempt: Attempt, progress: Progress) -> TrialRecord:
    begun, reason = attempt.begun, attempt.reason
    planned = _planned(protocol, participant, begun)
    status: Literal["complete", "fault", "withdrawn"]
    if attempt.status == "open":
        status, reason = ("withdrawn", "withdrawn") if progress.withdrawn else ("fault", INTERRUPTED)
    else:
        status = attempt.status
    return TrialRecord(
        participant=participant,
        trial=begun.trial,
        attempt=begun.attempt,
        practice=begun.practice,
        block=planned.block,
        condition=planned.condition,
        delay_ms=planned.delay_ms,
        scene=planned.scene,
        repeat=planned.repeat,
        seed=planned.seed,
        status=status,
        excluded="practice" if begun.practice and reason is None else reason,
        recording=recording_name(begun),
    )


def _planned(protocol: Protocol, participant: int, begun: Begun) -> Planned:
    if begun.practice:
        return practice_plan(protocol, participant, begun.trial)
    return schedule(protocol, participant)[begun.trial - 1]


def _condition(protocol: Protocol, participant: int, block: int) -> str:
    return next(planned.condition for planned in schedule(protocol, participant) if planned.block == block)
