"""A study with simulated participants, in virtual time, in as many processes as are asked for.

It goes through the same steps, journal and recordings as one with people.
"""

from collections import deque
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Final

from feelahead.both_sides.episode import Episode
from feelahead.both_sides.episode_hands import GRASPING
from feelahead.printing.progress import progress
from feelahead.study.events import Answered, Begun, Consented, Ended, Enrolled, Event, Rested, Resumed
from feelahead.study.folder import TRIALS, Study
from feelahead.study.protocol import Condition
from feelahead.study.records import recording_name
from feelahead.study.schedule import Planned, schedule, seed_of
from feelahead.study.steps import Consent, Enrol, Pause, Practice, Questions, Rest, Trial
from feelahead.study.trials.outcome import Outcome, outcome_of
from feelahead.study.trials.participants import Participant
from feelahead.study.trials.sides import side_values
from feelahead.workers import processes
from operator_side.people.settings import PersonSettings
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

_LOOK_S: Final = 0.25
_ARMING_S: Final = 6.0
"""Longest time before a trial begins, beyond two round trips"""
_TURN: Final = "10ms"
"""Period of both sides' turns. Stops are those of turns of 4 ms (docs/benchmarks.md), in two thirds of the time"""


@dataclass(frozen=True)
class Task:
    """One trial of one simulated participant."""

    participant: int
    planned: Planned
    condition: Condition
    person: PersonSettings
    person_seed: int
    """Seed of what the person does: another under each condition, as nobody errs twice alike"""
    limit_s: float
    recording: Path


def run_task(task: Task) -> tuple[float, Outcome | None]:
    """Run a trial into its recording; return how long it took, in virtual time, and what came out."""
    planned, condition = task.planned, task.condition
    values = side_values(planned, condition)
    robot = RobotSettings(**values.robot, tick_period=_TURN)  # its seed draws the link, too
    mine = {"seed": task.person_seed, "person": task.person, "tick_period": _TURN}
    operator = OperatorSettings(**values.operator | mine)
    task.recording.unlink(missing_ok=True)
    longest_s = task.limit_s + _ARMING_S + 4e-3 * planned.delay_ms
    with Episode(robot=robot, operator=operator, person=GRASPING, sampled=False) as episode:
        episode.record(task.recording)
        while episode.time_s < longest_s and not episode.done:
            episode.step(_LOOK_S)
        took_s = episode.time_s
    return took_s, outcome_of(task.recording, task.limit_s)


class _Participation:
    """One participant's way through the study."""

    def __init__(self, study: Study, number: int) -> None:
        self.number, self._study = number, study
        self._mind = Participant.drawn(study.protocol.seed, number)
        mine = [event.at_s for event in study.journal.events if event.participant == number]
        self._at_s = max(mine, default=0.0)

    def next_task(self) -> Task | None:
        """Take all steps up to the next trial, which has begun then; None when nothing is left."""
        study, number = self._study, self.number
        while True:
            event: Event
            match study.next_step(number):
                case Enrol():
                    event = Enrolled(participant=number, at_s=self._at_s, simulated=True)
                case Consent():
                    event = Consented(participant=number, at_s=self._at_s)
                case Pause():
                    event = Resumed(participant=number, at_s=self._at_s)
                case Rest(after, seconds):
                    self._at_s += seconds
                    event = Rested(participant=number, at_s=self._at_s, after=after)
                case Questions(block) as questions:
                    event = Answered(participant=number, at_s=self._at_s, block=block, values=self._answers(questions))
                case Practice() | Trial() as step:
                    practice = isinstance(step, Practice)
                    begun = Begun(
                        participant=number,
                        at_s=self._at_s,
                        trial=step.planned.number,
                        attempt=step.attempt,
                        practice=practice,
                    )
                    study.add(begun)
                    return self._task(step.planned, study.recording(begun))
                case _:
                    return None
            study.add(event)

    def end(self, took_s: float, outcome: Outcome | None) -> None:
        """Take the end of the trial that has begun."""
        begun = self._study.journal.progress(self.number).attempts[-1].begun
        self._at_s += took_s
        success = outcome is not None and outcome.completed
        self._study.add(
            Ended(
                participant=self.number,
                at_s=self._at_s,
                trial=begun.trial,
                attempt=begun.attempt,
                practice=begun.practice,
                success=success,
                by="placed" if success else "limit",
            )
        )

    def _task(self, planned: Planned, recording: Path) -> Task:
        protocol = self._study.protocol
        practised = sum(one.status == "complete" for one in self._study.journal.progress(self.number).attempts)
        seed = seed_of([planned.seed, list(protocol.conditions).index(planned.condition)])
        return Task(
            self.number,
            planned,
            protocol.conditions[planned.condition],
            self._mind.at(practised, seed),
            seed,
            protocol.limit_s,
            recording,
        )

    def _answers(self, asked: Questions) -> dict[str, float]:
        study, limit_s = self._study, self._study.protocol.limit_s
        plan = {one.number for one in schedule(study.protocol, self.number) if one.block == asked.block}
        files = [
            study.folder / TRIALS / recording_name(one.begun)
            for one in study.journal.progress(self.number).attempts
            if one.status == "complete" and not one.begun.practice and one.begun.trial in plan
        ]
        found = [outcome_of(file, limit_s) for file in files]
        hits = fmean([one is not None and one.hit for one in found])
        answers = {}
        for place, question in enumerate(asked.asked):
            seed = [study.protocol.seed, self.number, asked.block, place, 0xA5]
            answer = self._mind.answer(question.values[0], question.values[-1], hits, seed)
            answers[question.name] = min(question.values, key=lambda value, answer=answer: abs(value - answer))  # type: ignore[misc]
        return answers


def run_simulated(study: Study, participants: int, workers: int) -> None:
    """Let participants 1 to `participants` do what is left of the study. The figures do not depend on `workers`.

    ConfigurationError if people take part in this study.
    """
    study.require_all(simulated=True)
    people = deque(_Participation(study, number) for number in range(1, participants + 1))
    protocol = study.protocol
    left = sum(len(schedule(protocol, one.number)) - len(study.journal.progress(one.number).complete) for one in people)
    with progress("simulated participants", float(left or 1)) as shown, processes(workers) as pool:
        running: deque[tuple[_Participation, Future[tuple[float, Outcome | None]]]] = deque()
        while people or running:
            while people and len(running) < workers:
                one = people.popleft()
                if (task := one.next_task()) is not None:
                    shown.begin(f"participant {one.number}, trial {task.planned.number}")
                    running.append((one, pool.submit(run_task, task)))
            if running:
                one, future = running.popleft()
                one.end(*future.result())
                people.append(one)
                shown.advance(1.0)
