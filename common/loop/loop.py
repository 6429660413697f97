"""Loop of a side: turns at absolute deadlines, messages when they arrive, other work after sending."""

import sys
from typing import Any, Protocol, TypeVar

from common.clock import Clock, MonotonicClock, ThreadClock
from common.command.stop_signal import StopSignal
from common.realtime.garbage import IdleCollection
from common.realtime.pacing import Pacer, wait_for_turn
from common.realtime.period_monitor import PeriodMonitor

Received = TypeVar("Received")


class Side(Protocol[Received]):
    """Work of one side, in the calls that Loop makes; only `wait` may block."""

    @property
    def resting(self) -> bool:
        """Whether nothing moves, so that there is time for garbage collection."""

    def note(self, text: str) -> None:
        """Show one line wherever this side's status is shown."""

    def receive(self) -> Received:
        """Return the messages that have arrived."""

    def handle(self, received: Received, now_s: float) -> None:
        """Process the messages."""

    def turn(self, now_s: float) -> None:
        """Do the work of one period."""

    def send(self) -> None:
        """Send the messages that are due."""

    def rest(self, now_s: float, turned_s: float) -> None:
        """Do the less urgent work of the turn that began at `turned_s`, after its messages have been sent."""

    def wait(self, timeout_s: float) -> bool:
        """Wait at most `timeout_s` for a message; return whether there is one."""

    def next_due(self) -> float | None:
        """Return the time at which the next waiting message must leave; None if none waits."""


class Loop:
    """Loop that runs a side, and measures whether it keeps the period."""

    def __init__(self, period_s: float, remedy: str, seed: int, clock: Clock | None = None) -> None:
        """remedy: what would shorten the turns, to be named if they take too long."""
        self.clock = MonotonicClock() if clock is None else clock
        self.computed = ThreadClock()
        """Processor time of the loop's thread"""
        self.start_s = self.clock.now()
        self.pacer = Pacer(period_s, self.start_s, seed)
        self._period = PeriodMonitor(self.pacer, self.clock, self.computed, remedy)
        self._collection = IdleCollection(self.clock)
        self._loaded_late: list[str] = []

    def run(self, side: Side[Received], stop: StopSignal, duration_s: float | None) -> None:
        """Run until `stop` is set or `duration_s` has passed; show a note, once, if the period cannot be kept."""
        pacer, clock, loaded = self.pacer, self.clock, frozenset(sys.modules)
        with self._collection:
            self.start_s = clock.now()
            pacer.restart(self.start_s)
            while not stop.is_set:
                self._period.begin()
                received = side.receive()
                # Read after receiving: a process that was paused in between must not take old messages for new.
                now_s = clock.now()
                if duration_s is not None and now_s - self.start_s >= duration_s:
                    break
                side.handle(received, now_s)
                turned = pacer.due(now_s)
                if turned:
                    pacer.begin(now_s)
                    side.turn(now_s)
                side.send()
                if turned:
                    rest_s = clock.now()
                    side.rest(rest_s, now_s)
                    self._collection.idle(rest_s, resting=side.resting)
                if (said := self._period.end(turned=turned)) is not None:
                    side.note(said)
                wait_for_turn(pacer, clock, side.wait, side.next_due())
        self._loaded_late = sorted(sys.modules.keys() - loaded)

    def summary(self, side: str) -> dict[str, Any]:
        """Return the loop's part of a run's summary: duration and pacing of the turns, and modules loaded in turns.

        Such a module may delay the next command for longer than an arm goes on without one.
        """
        return {
            "duration_s": self.clock.now() - self.start_s,
            "machine": {side: self._period.summary()},
            "pacing": {
                side: self.pacer.summary()
                | {"turn_cpu_us": self._period.turn_cpu_us(), "garbage": self._collection.summary()}
            },
            "loaded_late": {side: self._loaded_late},
        }
