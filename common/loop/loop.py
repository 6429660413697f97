"""Loop of a side: turns at absolute deadlines, messages as they come, all else after the sends."""

from collections.abc import Mapping
from typing import Any, Final, Protocol, TypeVar

from common.clock import Clock, MonotonicClock, ThreadClock
from common.command.stop_signal import StopSignal
from common.realtime.garbage import IdleCollection
from common.realtime.pacing import Pacer, wait_for_turn
from common.realtime.period_monitor import PeriodMonitor
from common.realtime.stages import Stages

Received = TypeVar("Received")
SOCKETS: Final = "sockets"
"""Stage of receiving and sending."""


class Side(Protocol[Received]):
    """Work of one side; no call waits but `wait`."""

    @property
    def resting(self) -> bool:
        """Whether nothing moves: there is time to collect garbage."""

    def note(self, text: str) -> None:
        """Show one line to all people who watch this side."""

    def receive(self) -> Received:
        """Return the messages that have arrived."""

    def take(self, received: Received, now_s: float) -> None:
        """Process the messages."""

    def turn(self, now_s: float) -> None:
        """Do the work of one period."""

    def send(self) -> None:
        """Send the messages that are due."""

    def rest(self, now_s: float, turned_s: float) -> None:
        """Do the work that may follow the sends, after the turn at `turned_s`."""

    def wait(self, timeout_s: float) -> bool:
        """Wait for a message; return whether there is one."""

    def next_due(self) -> float | None:
        """Return when the next message must leave; None while none waits."""


class Loop:
    """Loop that runs a side, and measures whether it keeps the period."""

    def __init__(self, period_s: float, remedies: Mapping[str, str], seed: int, clock: Clock | None = None) -> None:
        """remedies: remedy for each stage of a turn, by name; "" for the time outside of stages."""
        self.clock = MonotonicClock() if clock is None else clock
        self.computed = ThreadClock()
        """Processor time of the loop's thread"""
        self.stages = Stages(tuple(filter(None, remedies)), self.clock, self.computed, seed)
        self.start_s = self.clock.now()
        self.pacer = Pacer(period_s, self.start_s, seed)
        self._period = PeriodMonitor(self.pacer, self.stages, self.clock, self.computed, remedies)
        self._collection = IdleCollection(self.clock)

    def run(self, side: Side[Received], stop: StopSignal, duration_s: float | None) -> None:
        """Run until `stop`, or for `duration_s`; note once, in words, if the period cannot be kept."""
        receive, send = self.stages.timed(SOCKETS, side.receive), self.stages.timed(SOCKETS, side.send)
        pacer, clock = self.pacer, self.clock
        with self._collection:
            self.start_s = clock.now()
            pacer.restart(self.start_s)
            while not stop.is_set:
                self._period.begin()
                received = receive()
                # Read after receiving: a process that was paused in between must not take old messages for new.
                now_s = clock.now()
                if duration_s is not None and now_s - self.start_s >= duration_s:
                    break
                side.take(received, now_s)
                turned = pacer.due(now_s)
                if turned:
                    pacer.begin(now_s)
                    side.turn(now_s)
                send()
                if turned:
                    rest_s = clock.now()
                    side.rest(rest_s, now_s)
                    self._collection.idle(rest_s, resting=side.resting)
                if (said := self._period.end(turned=turned)) is not None:
                    side.note(said)
                wait_for_turn(pacer, clock, side.wait, side.next_due())

    def summary(self, side: str) -> dict[str, Any]:
        """Return duration, pacing of the turns, and times of the stages."""
        return {
            "duration_s": self.clock.now() - self.start_s,
            "stages": {side: self.stages.summary()},
            "machine": {side: self._period.summary()},
            "pacing": {side: self.pacer.summary() | {"garbage": self._collection.summary()}},
        }
