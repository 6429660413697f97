"""State of one participant, folded from the events: what is done, what comes next, which event may come."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Final, Literal

from feelahead.study.events import (
    Answered,
    Begun,
    Consented,
    Ended,
    Enrolled,
    Event,
    Failed,
    Paused,
    Rested,
    Resumed,
    Withdrew,
)
from feelahead.study.protocol import PracticeSettings, Protocol
from feelahead.study.questionnaires import check_answers
from feelahead.study.schedule import Planned, schedule, seed_of
from feelahead.study.steps import (
    Consent,
    Done,
    Enrol,
    Pause,
    Practice,
    Questions,
    Rest,
    Step,
    Trial,
    Withdrawn,
    public,
)

INTERRUPTED: Final = "interrupted"
"""Reason of a fault that nobody reported, as kill -9 or a power cut"""
BY_EXPERIMENTER: Final = "ended by the experimenter"
"""Why a trial that was ended early counts for nothing"""
NEVER_ARMED: Final = "the arm was never armed"
"""Reason of a fault, or in an older journal of an exclusion"""


@dataclass(frozen=True)
class Attempt:
    """A trial, or a try of practice, that was begun."""

    begun: Begun
    status: Literal["open", "complete", "fault"] = "open"
    """open: it is running, or was cut off, as by kill -9"""
    success: bool | None = None
    reason: str | None = None
    """Reason of a fault, or why a complete one counts for nothing"""


@dataclass(frozen=True)
class Progress:
    """State of a participant."""

    enrolled: bool = False
    consented: bool = False
    paused: bool = False
    withdrawn: bool = False
    attempts: tuple[Attempt, ...] = ()
    answers: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    """By block, then by the question's name"""
    rested: frozenset[int] = frozenset()
    """Numbers of trials after which there was a rest"""
    repeatable: bool = False
    """Whether the last attempt, though complete, may still be said to be a fault"""

    @property
    def open(self) -> Attempt | None:
        """The attempt that has no end yet"""
        return self.attempts[-1] if self.attempts and self.attempts[-1].status == "open" else None

    @property
    def complete(self) -> frozenset[int]:
        """Numbers of the plan's complete trials"""
        return frozenset(
            one.begun.trial for one in self.attempts if one.status == "complete" and not one.begun.practice
        )

    def after(self, event: Event) -> "Progress":
        """Return the state after `event`."""
        match event:
            case Enrolled():
                new = replace(self, enrolled=True)
            case Consented():
                new = replace(self, consented=True)
            case Begun():
                before = self.attempts if self.open is None else self._last("fault", reason=INTERRUPTED)
                new = replace(self, attempts=(*before, Attempt(event)), repeatable=False)
            case Ended():
                reason = BY_EXPERIMENTER if event.by == "experimenter" else None
                attempts = self._last("complete", success=event.success, reason=reason)
                new = replace(self, attempts=attempts, repeatable=True)
            case Failed():
                new = replace(self, attempts=self._last("fault", reason=event.reason), repeatable=False)
            case Answered():
                new = replace(self, answers={**self.answers, event.block: event.values}, repeatable=False)
            case Rested():
                new = replace(self, rested=self.rested | {event.after})
            case Paused() | Resumed():
                new = replace(self, paused=isinstance(event, Paused))
            case Withdrew():
                new = replace(self, withdrawn=True)
        return new

    def practised(self, settings: PracticeSettings | None) -> bool | None:
        """Return whether practice ended with enough successes in a row; None: it has not ended yet."""
        if settings is None:
            return True
        tries = [one.success for one in self.attempts if one.begun.practice and one.status == "complete"]
        if len(tries) >= settings.successes and all(tries[-settings.successes :]):
            return True
        return False if len(tries) >= settings.most else None

    def _last(
        self, status: Literal["complete", "fault"], *, success: bool | None = None, reason: str | None = None
    ) -> tuple[Attempt, ...]:
        """Return the attempts, the last of which has ended so."""
        return (*self.attempts[:-1], replace(self.attempts[-1], status=status, success=success, reason=reason))


def progress_of(events: Iterable[Event], participant: int) -> Progress:
    """Return the state of a participant after all events of a study."""
    mine = (event for event in events if event.participant == participant)
    return reduce(Progress.after, mine, Progress())


def next_step(protocol: Protocol, events: Iterable[Event], participant: int) -> Step:
    """Return what comes next for a participant. An attempt without an end is a fault: its trial comes again."""
    return step_after(protocol, progress_of(events, participant), participant)


def step_after(protocol: Protocol, progress: Progress, participant: int) -> Step:
    """Return what comes next for the participant with this state."""
    if not progress.enrolled:
        return Enrol()
    if progress.withdrawn:
        return Withdrawn()
    if progress.paused:
        return Pause()
    if not progress.consented:
        return Consent()
    settings = protocol.practice
    if settings is not None and progress.practised(settings) is None:
        tries = sum(one.begun.practice and one.status == "complete" for one in progress.attempts)
        planned = practice_plan(protocol, participant, tries + 1)
        return Practice(planned, _next_attempt(progress, planned.number, practice=True), settings.most)
    return _in_plan(protocol, progress, schedule(protocol, participant))


def require_next(protocol: Protocol, progress: Progress, event: Event) -> None:
    """Raise ValueError if `event` may not come now, so that no trial is left out or done twice.

    The text names no condition.
    """
    step = step_after(protocol, progress, event.participant)
    here = progress.enrolled and not progress.withdrawn
    match event, step:
        case (Enrolled(), Enrol()) | (Consented(), Consent()) | (Resumed(), Pause()):
            return
        case Begun(), Trial() | Practice():
            if event.key == (isinstance(step, Practice), step.planned.number, step.attempt):
                return
        case Answered(), Questions():
            check_answers(step.asked, event.values)
            if event.block == step.block:
                return
        case Rested(), Rest():
            if event.after == step.after:
                return
        case ((Ended() | Failed()), _) if here and progress.attempts:
            again = isinstance(event, Failed) and progress.repeatable
            if event.key == progress.attempts[-1].begun.key and (progress.open or again):
                return
        case Paused(), _ if here and not progress.paused:
            return
        case Withdrew(), _ if here:
            return
    raise ValueError(
        f"participant {event.participant}: {type(event).__name__.lower()} does not come now;"
        f" valid: what goes with {public(step)['step']}"
    )


def practice_plan(protocol: Protocol, participant: int, number: int) -> Planned:
    """Return the cell and seed of a try of practice, from 1; ValueError if the protocol has no practice."""
    if (settings := protocol.practice) is None:
        raise ValueError(f"{protocol.name}: practice = none; valid: a protocol with practice")
    seed = seed_of([protocol.seed, participant, number, 0, 0, 1])  # longer than those of the plan
    return Planned(number, 0, settings.condition, settings.delay_ms, settings.scene, number, seed)


def _next_attempt(progress: Progress, trial: int, *, practice: bool) -> int:
    before = (one.begun for one in progress.attempts)
    return 1 + sum((begun.practice, begun.trial) == (practice, trial) for begun in before)


def _in_plan(protocol: Protocol, progress: Progress, plan: tuple[Planned, ...]) -> Step:
    complete = progress.complete
    upcoming = next((planned for planned in plan if planned.number not in complete), None)
    finished = len(protocol.conditions) if upcoming is None else upcoming.block - 1
    for block in range(1, finished + 1):
        if protocol.questions and block not in progress.answers:
            return Questions(block, protocol.questions)
    if upcoming is None:
        return Done()
    done, rest = len(complete), protocol.rest
    if rest is not None and done and done % rest.trials == 0 and done not in progress.rested:
        return Rest(done, rest.seconds)
    return Trial(upcoming, _next_attempt(progress, upcoming.number, practice=False), len(plan))
