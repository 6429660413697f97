"""One participant's session, driven by what two pages say, by what the sides report, and by the time."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from common.errors import FeelaheadError
from feelahead.study.events import Begun, Ended, EndedBy, Event, Failed, Rested, Withdrew, event_of
from feelahead.study.folder import Study
from feelahead.study.protocol import Condition
from feelahead.study.schedule import Planned
from feelahead.study.steps import Practice, Rest, Trial, public


@dataclass(frozen=True)
class Start:
    """The sides are to be started for a trial; who starts them calls `up`, then `ended` or `lost`."""

    planned: Planned
    condition: Condition
    recording: Path


@dataclass(frozen=True)
class Stop:
    """The sides are to be stopped, and the recording closed. After a time limit `ended` is to follow."""

    reason: str


@dataclass
class _Run:
    begun: Begun
    up_s: float | None = None
    """When both sides were up"""
    stopped: bool = False
    end: Ended | None = None
    """End that could not be written yet, as on a full disk"""


class Session:
    """A participant's session. An event counts once it is on the disk; whoever asks for one that cannot be is told."""

    def __init__(self, study: Study, participant: int) -> None:
        """Go on where the participant is; an attempt that was cut off is repeated."""
        self._study, self._participant = study, participant
        self._run: _Run | None = None
        self._rest: tuple[int, float] | None = None
        """Number of trials after which the rest began, and when"""
        self._trouble: str | None = None

    def hear(self, said: Mapping[str, Any], now_s: float, at_s: float) -> Start | Stop | None:
        """Take an event from a page, and return what is to be done with the sides.

        said: `event` and the fields that only the page knows: `values` of answers, `reason` of a fault or of a
        withdrawal. at_s: time of the wall clock. ValueError if it may not come now; FeelaheadError if it cannot be
        written. Neither text names a condition.
        """
        known = self._known(said.get("event"))
        if known is None:
            raise ValueError(f"{said['event']} does not come now; valid: what goes with {self._shown()['step']}")
        event = event_of({**said, **known, "participant": self._participant, "at_s": at_s})
        if isinstance(event, Rested) and (left_s := self._rest_left_s(now_s)):
            raise ValueError(f"rested: {left_s:.0f} s are left; valid: after them")
        step = self._study.next_step(self._participant)
        try:
            self._add(event)
        except FeelaheadError:
            # One who has withdrawn is stopped, even if their data cannot be removed yet.
            if not self._study.journal.progress(self._participant).withdrawn:
                raise
        run, running = self._run, isinstance(event, Failed | Withdrew)
        if isinstance(event, Begun) and isinstance(step, Practice | Trial):
            self._run = _Run(event)
            condition = self._study.protocol.conditions[step.planned.condition]
            return Start(step.planned, condition, self._study.recording(event))
        if running and run is not None:
            self._run = None
            return Stop(str(said["event"]))
        return None

    def up(self, now_s: float) -> None:
        """Hear that both sides of the trial are up: its time begins."""
        if self._run is not None:
            self._run.up_s = now_s

    def ended(self, by: EndedBy, at_s: float) -> None:
        """Hear that the trial has come to its end, and that its recording is closed.

        An end that cannot be written is written later by `turn`; the pages show the trouble until then.
        """
        if self._run is not None:
            begun = self._run.begun
            self._run.end = Ended(**_of(begun), at_s=at_s, success=by == "placed", by=by)
            self._write_end()

    def lost(self, reason: str, at_s: float) -> None:
        """Hear that a side, or the link, has failed: the trial is a fault. FeelaheadError if it cannot be written."""
        if self._run is not None:
            self._add(Failed(**_of(self._run.begun), at_s=at_s, reason=reason))
            self._run = None

    def turn(self, now_s: float) -> Stop | None:
        """Let time pass: return Stop once, when the trial has had its time."""
        if (run := self._run) is None:
            return None
        if run.end is not None:
            self._write_end()
        elif run.up_s is not None and not run.stopped and now_s - run.up_s >= self._study.protocol.limit_s:
            run.stopped = True
            return Stop("time limit")
        return None

    def view(self, now_s: float) -> Mapping[str, Mapping[str, Any]]:
        """Return what the page of the participant and that of the experimenter show; neither tells the condition."""
        progress, run = self._study.journal.progress(self._participant), self._run
        shown = {**self._shown(), "participant": self._participant, "running": run is not None}
        if left_s := self._rest_left_s(now_s):
            shown["rest_left_s"] = left_s
        faults = [one for one in progress.attempts if one.status == "fault"]
        return {
            "participant": shown,
            "experimenter": shown
            | {
                "trials_done": len(progress.complete),
                "faults": [one.reason for one in faults],
                "practised": progress.practised(self._study.protocol.practice),
                "may_repeat": progress.repeatable and run is None,
                "paused": progress.paused,
                "running_s": None if run is None or run.up_s is None else now_s - run.up_s,
                "trouble": self._trouble,
            },
        }

    def _shown(self) -> Mapping[str, Any]:
        """Return what is shown of the step; while a trial runs, of that trial."""
        if self._run is None:
            return public(self._study.next_step(self._participant))
        begun = self._run.begun
        return {"step": "practice" if begun.practice else "trial", "number": begun.trial, "attempt": begun.attempt}

    def _known(self, name: object) -> Mapping[str, Any] | None:
        """Return the fields of an event that follow from the state; None if a page may not say it now."""
        step = self._study.next_step(self._participant)
        attempts = self._study.journal.progress(self._participant).attempts
        match name, step:
            case "begun", Practice() | Trial() if self._run is None:
                practice = isinstance(step, Practice)
                return {"trial": step.planned.number, "attempt": step.attempt, "practice": practice}
            case "failed", _ if attempts:
                return _of(attempts[-1].begun)
            case "rested", Rest():
                return {"after": step.after}
        return None if name in ("begun", "ended", "failed", "rested") else {}

    def _rest_left_s(self, now_s: float) -> float:
        step = self._study.next_step(self._participant)
        if self._run is not None or not isinstance(step, Rest):
            return 0.0
        if self._rest is None or self._rest[0] != step.after:
            self._rest = step.after, now_s
        return max(0.0, self._rest[1] + step.seconds - now_s)

    def _write_end(self) -> None:
        if self._run is not None and self._run.end is not None:
            try:
                self._add(self._run.end)
            except FeelaheadError:
                return
            self._run = None

    def _add(self, event: Event) -> None:
        try:
            self._study.add(event)
        except FeelaheadError as error:
            self._trouble = str(error)
            raise
        self._trouble = None


def _of(begun: Begun) -> dict[str, Any]:
    return {
        "participant": begun.participant,
        "trial": begun.trial,
        "attempt": begun.attempt,
        "practice": begun.practice,
    }
