"""A study in the room: what its two pages may say, what becomes of the sides, and what the pages show.

It decides alone, and does nothing: whoever drives it starts and stops the sides that it asks for.
"""

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from common.errors import FeelaheadError
from feelahead.study.balance import left_minutes, next_number
from feelahead.study.events import EndedBy
from feelahead.study.folder import Study
from feelahead.study.progress import NEVER_ARMED
from feelahead.study.protocol import STANDS_S
from feelahead.study.schedule import schedule
from feelahead.study.session import Session, Start, Stop
from feelahead.study.steps import Done, Practice, Trial, Withdrawn, public

Page = Literal["experimenter", "participant"]
_MAY_SAY: Final[Mapping[Page, tuple[str, ...]]] = {
    "experimenter": (
        *("choose", "enrolled", "consented", "begun", "end", "failed", "paused", "resumed", "withdrew", "at_once"),
    ),
    "participant": ("ready", "answered", "rested"),
}
_GONE_S: Final = 3.0
"""Time after which a link or controller that was lost is a fault"""
_WRITE_AGAIN_S: Final = 1.0


@dataclass(frozen=True)
class Seen:
    """What was heard of the sides of a trial until now; None is unknown."""

    side: str = "starting"
    """State of both sides, in words"""
    controller: str | None = None
    lost: str | None = None
    """What is lost at present and may come back: the link, the controller"""
    failed: str | None = None
    """What has failed for good, in words that name no condition"""
    armed: bool = False
    placed: bool | None = None
    console: str | None = None
    """Address of the page on which the participant sees and drives"""


@dataclass
class _Run:
    """A trial whose sides run, or are being stopped."""

    seen: Seen = Seen()
    armed: bool = False
    stands_since_s: float | None = None
    lost_since_s: float | None = None
    stopping: bool = False
    by: EndedBy = "limit"
    """What ends it, unless it has a fault"""
    settled: bool = False
    """Whether the journal has its end already: a fault, or a withdrawal"""
    closed: bool = False
    fault: str | None = None
    unwritten: Mapping[str, Any] | None = None
    """What a page said of its end, and could not be written yet: a fault, or a withdrawal"""
    written_s: float | None = None
    """When it was last tried to write its fault down"""

    @property
    def failed(self) -> bool:
        """Whether it has another end than a trial that counts"""
        return self.fault is not None or self.unwritten is not None


class Room:
    """A study in one room: one participant at a time, in one trial at a time."""

    def __init__(self, study: Study, participant: int | None = None) -> None:
        """participant: who is here; None: who was here when the study ended, if there is anything left to do."""
        self._study = study
        self._session: Session | None = None
        self._number = 0
        self._run: _Run | None = None
        self._ready = self._at_once = False
        events = study.journal.events
        if participant is None and events:
            last = events[-1].participant
            participant = None if isinstance(study.next_step(last), Done | Withdrawn) else last
        if participant is not None:
            self._choose(participant)
        self._listed = self._list()

    @property
    def busy(self) -> bool:
        """Whether the sides of a trial run, or are being stopped"""
        return self._run is not None

    def hear(self, page: Page, said: Mapping[str, Any], now_s: float, at_s: float) -> Start | Stop | None:
        """Take what a page says, and return what is to be done with the sides.

        said: `event`, and what goes with it. at_s: time of the wall clock. ValueError if it may not come now,
        FeelaheadError if it cannot be written; both texts are for the page, and name no condition.
        """
        name = said.get("event")
        if name not in _MAY_SAY[page]:
            raise ValueError(f"event {name!r}; valid: {', '.join(_MAY_SAY[page])}")
        found = self._hear(str(name), said, now_s, at_s)
        self._listed = self._list()
        return found

    def take(self, seen: Seen, now_s: float) -> Stop | None:
        """Take what was heard of the sides; return Stop once, when the trial is over."""
        if (run := self._run) is None or run.stopping:
            return None
        run.seen = seen
        if seen.armed and not run.armed and self._session is not None:
            run.armed = True
            self._session.up(now_s)
        run.stands_since_s = (run.stands_since_s or now_s) if seen.placed and run.armed else None
        run.lost_since_s = (run.lost_since_s or now_s) if seen.lost is not None else None
        run.fault = seen.failed
        if run.lost_since_s is not None and now_s - run.lost_since_s >= _GONE_S:
            run.fault = seen.lost
        if run.fault is not None:
            return self._stop(Stop("fault"))
        if run.stands_since_s is not None and now_s - run.stands_since_s >= STANDS_S:
            run.by = "placed"
            return self._stop(Stop("placed"))
        return None

    def closed(self, error: str | None, now_s: float, at_s: float) -> None:
        """Hear that the sides have ended and the recording is closed. error: why the recording is not whole."""
        if (run := self._run) is None or self._session is None:
            return
        run.closed, run.fault = True, run.fault or error or (None if run.armed else NEVER_ARMED)
        if run.settled or run.failed:
            self._write_fault(run, now_s, at_s)
        else:
            self._session.ended(run.by, at_s)
            self._free()

    def turn(self, now_s: float, at_s: float) -> Stop | None:
        """Let time pass: write down what could not be; return Stop once, when the trial has had its time."""
        run = self._run
        if run is not None and run.closed and run.failed:
            if run.written_s is None or now_s - run.written_s >= _WRITE_AGAIN_S:
                self._write_fault(run, now_s, at_s)
            return None
        stop = None if self._session is None else self._session.turn(now_s)
        if run is not None and run.closed:
            self._free()
        return None if stop is None or run is None or run.stopping else self._stop(stop)

    def view(self, now_s: float) -> dict[Page, dict[str, Any]]:
        """Return what each page shows; neither tells the condition."""
        run = self._run
        phase = None if run is None else "saving" if run.closed else "stopping" if run.stopping else run.seen.side
        protocol = self._study.protocol
        shared: dict[str, Any] = {
            "study": protocol.name,
            "controller": protocol.controller,
            "limit_s": protocol.limit_s,
        }
        shared |= {"limit_s": protocol.limit_s, "phase": phase, "ready": self._ready}
        views: dict[str, Any] = {} if self._session is None else dict(self._session.view(now_s))
        # Nothing to drive, once the sides are being stopped.
        console = None if run is None or run.stopping else run.seen.console
        participants, proposed = self._listed
        left = {}
        if self._session is not None:
            progress = self._study.journal.progress(self._number)
            left = {"minutes_left": left_minutes(protocol, progress, self._number)}
            shared |= {"of": len(schedule(protocol, self._number))} if views["participant"]["step"] == "trial" else {}
        return {
            "experimenter": {
                "step": "choose",
                **views.get("experimenter", {}),
                **shared,
                **left,
                "participants": participants,
                "proposed": proposed,
                "at_once": self._at_once,
                "controller_state": None if run is None else run.seen.controller,
            },
            "participant": {"step": "choose", **views.get("participant", {}), **shared, "console": console},
        }

    def _hear(self, name: str, said: Mapping[str, Any], now_s: float, at_s: float) -> Start | Stop | None:
        session = self._session
        if name == "choose":
            if self._run is not None:
                raise ValueError("choose: a trial runs; valid: after it")
            self._choose(said.get("participant"))
            return None
        if name == "at_once":
            self._at_once = said.get("value") is True
            return self._begin(now_s, at_s) if self._at_once and self._ready else None
        if session is None:
            raise ValueError(f"{name}: nobody is here; valid: choose")
        if name == "ready":
            step = self._study.next_step(self._number)
            if self._run is not None or not isinstance(step, Practice | Trial):
                raise ValueError(f"ready does not come now; valid: before a trial, not with {public(step)['step']}")
            self._ready = True
            return self._begin(now_s, at_s) if self._at_once else None
        if name == "begun":
            return self._begin(now_s, at_s)
        if name == "end":
            if self._run is None or self._run.stopping:
                raise ValueError("end: no trial runs; valid: while one does")
            self._run.by = "experimenter"
            return self._stop(Stop("experimenter"))
        return self._tell(session, name, said, now_s, at_s)

    def _tell(
        self, session: Session, name: str, said: Mapping[str, Any], now_s: float, at_s: float
    ) -> Start | Stop | None:
        try:
            stop = session.hear(said, now_s, at_s)
        except FeelaheadError:
            if self._run is None or name not in ("failed", "withdrew"):
                raise
            # The arm waits for no disk; the pages show the trouble.
            already, self._run.unwritten = self._run.stopping, said
            return None if already else self._stop(Stop(name))
        if name != "answered":
            self._ready = False
        if not isinstance(stop, Stop) or self._run is None:
            return None
        self._run.settled = True
        already = self._run.stopping
        if self._run.closed:
            self._free()
        return None if already else self._stop(stop)

    def _begin(self, now_s: float, at_s: float) -> Start | None:
        if self._session is None or self._run is not None:
            raise ValueError("begun: the sides of a trial run; valid: once they have ended")
        start = self._session.hear({"event": "begun"}, now_s, at_s)
        self._ready = False
        if not isinstance(start, Start):
            return None
        self._run = _Run()
        return start

    def _stop(self, stop: Stop) -> Stop:
        if self._run is not None:
            self._run.stopping = True
        return stop

    def _write_fault(self, run: _Run, now_s: float, at_s: float) -> None:
        if not run.settled and self._session is not None:
            run.written_s = now_s
            with contextlib.suppress(FeelaheadError):  # the pages show it as trouble
                if run.unwritten is None:
                    self._session.lost(str(run.fault), at_s)
                else:
                    self._session.hear(run.unwritten, now_s, at_s)
                run.settled = True
        self._free()

    def _free(self) -> None:
        """Forget the trial once the journal has its end."""
        run = self._run
        if run is not None and run.closed and (run.settled or not self._owes_an_end):
            self._run = None
            self._listed = self._list()

    @property
    def _owes_an_end(self) -> bool:
        """Whether the end of the attempt could not be written yet"""
        return self._study.journal.progress(self._number).open is not None

    def _choose(self, participant: object) -> None:
        if not isinstance(participant, int) or isinstance(participant, bool) or not 1 <= participant <= 999:
            raise ValueError(f"participant {participant!r}; valid: a number from 1 to 999")
        self._number, self._session = participant, Session(self._study, participant)
        self._ready = False

    def _list(self) -> tuple[list[dict[str, Any]], int]:
        """Return a row for each participant, and the number of the next one."""
        rows = []
        for number in self._study.journal.participants:
            progress = self._study.journal.progress(number)
            faults = sum(one.status == "fault" for one in progress.attempts)
            step = public(self._study.next_step(number))["step"]
            done, of = len(progress.complete), len(schedule(self._study.protocol, number))
            rows.append({"number": number, "step": step, "trials_done": done, "of": of, "faults": faults})
        gone = [row["number"] for row in rows if row["step"] == "withdrawn"]
        return rows, next_number(self._study.protocol, {row["number"] for row in rows}, gone)
