"""A participant's session without people: each step is done at once, as a caller of a study would do it."""

from collections.abc import Callable
from typing import Any

from feelahead.study.events import (
    Answered,
    Begun,
    Consented,
    Ended,
    Enrolled,
    Event,
    Failed,
    Rested,
    Resumed,
)
from feelahead.study.folder import Study
from feelahead.study.steps import Consent, Done, Enrol, Pause, Practice, Questions, Rest, Step, Trial, Withdrawn


def begun(step: Practice | Trial, participant: int, at_s: float) -> Begun:
    practice = isinstance(step, Practice)
    return Begun(participant=participant, at_s=at_s, trial=step.planned.number, attempt=step.attempt, practice=practice)


def end_of(event: Begun, success: bool | None = True) -> Ended:
    return Ended(**_fields(event), success=success)


def fault_of(event: Begun, reason: str = "the phone rang") -> Failed:
    return Failed(**_fields(event), reason=reason)


def answer_to(step: Step, participant: int, at_s: float = 0.0) -> Event | None:
    """Return the event that does a step other than a trial; None if there is nothing to do."""
    common: dict[str, Any] = {"participant": participant, "at_s": at_s}
    match step:
        case Enrol():
            return Enrolled(**common)
        case Consent():
            return Consented(**common)
        case Pause():
            return Resumed(**common)
        case Rest():
            return Rested(after=step.after, **common)
        case Questions():
            return Answered(block=step.block, values={one.name: one.values[-1] for one in step.asked}, **common)
    return None


def do_step(study: Study, participant: int, at_s: float = 0.0, write: Callable[[Begun], object] | None = None) -> Step:
    """Do what comes next, and return it. write: makes the recording; unless given, a file with the trial's name."""
    step = study.next_step(participant)
    if isinstance(step, Practice | Trial):
        event = begun(step, participant, at_s)
        study.add(event)
        (write or (lambda one: study.recording(one).write_text(study.recording(one).name)))(event)
        study.add(end_of(event))
    elif (answer := answer_to(step, participant, at_s)) is not None:
        study.add(answer)
    return step


def do_all(study: Study, participant: int, most: int = 200) -> list[Step]:
    """Do everything that comes, and return the steps."""
    steps: list[Step] = []
    for number in range(most):
        steps.append(do_step(study, participant, float(number)))
        if isinstance(steps[-1], Done | Withdrawn):
            break
    return steps


def _fields(event: Begun) -> dict[str, Any]:
    return {name: getattr(event, name) for name in ("participant", "at_s", "trial", "attempt", "practice")}
