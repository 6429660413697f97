"""The loop of a side: turns at absolute deadlines, messages as they come, all that may wait after they have left."""

from collections.abc import Mapping
from typing import Any, Final, Protocol, TypeVar

from common.clock import Clock, MonotonicClock, ThreadClock
from common.command.stop_signal import StopSignal
from common.realtime.garbage import IdleCollection
from common.realtime.keeping_up import KeepingUp
from common.realtime.pacing import Pacer, wait_for_turn
from common.realtime.stages import Stages

Received = TypeVar("Received")
SOCKETS: Final = "sockets"
"""The stage of receiving and sending."""


class Side(Protocol[Received]):
    """The work of one side; no call waits but `wait`."""

    @property
    def resting(self) -> bool:
        """Nothing moves: there is time to collect garbage."""

    def note(self, text: str) -> None:
        """Tell one line to all people who look at this side."""

    def receive(self) -> Received:
        """Return what has arrived."""

    def take(self, received: Received, now_s: float) -> None:
        """Judge what has arrived."""

    def turn(self, now_s: float) -> None:
        """Do what is due once a period."""

    def send(self) -> None:
        """Let go of what is due to leave."""

    def rest(self, now_s: float, turned_s: float) -> None:
        """Do all that no message should wait for, after the turn at `turned_s`."""

    def wait(self, timeout_s: float) -> bool:
        """Wait for a message; tell whether there is one."""

    def next_due(self) -> float | None:
        """Return when the next message has to leave; None while none waits."""


class Loop:
    """Runs a side, and measures whether it keeps its period."""

    def __init__(self, period_s: float, helps: Mapping[str, str], seed: int, clock: Clock | None = None) -> None:
        """helps: what makes each stage of a turn shorter, by its name, and "" for all else."""
        self.clock = MonotonicClock() if clock is None else clock
        self.computed = ThreadClock()
        """Processor time of the thread that runs the loop"""
        self.stages = Stages(tuple(filter(None, helps)), self.clock, self.computed, seed)
        self.start_s = self.clock.now()
        self.pacer = Pacer(period_s, self.start_s, seed)
        self._keeping_up = KeepingUp(self.pacer, self.stages, self.clock, self.computed, helps)
        self._collection = IdleCollection(self.clock)

    def run(self, side: Side[Received], stop: StopSignal, duration_s: float | None) -> None:
        """Go on until `stop`, or for `duration_s`; say once, in words, when the period cannot be kept."""
        receive, send = self.stages.timed(SOCKETS, side.receive), self.stages.timed(SOCKETS, side.send)
        pacer, clock = self.pacer, self.clock
        with self._collection:
            self.start_s = clock.now()
            pacer.restart(self.start_s)
            while not stop.is_set:
                self._keeping_up.begin()
                received = receive()
                # Read after receiving: a process that was stopped in between must not take old messages for new.
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
                if (said := self._keeping_up.end(turned=turned)) is not None:
                    side.note(said)
                wait_for_turn(pacer, clock, side.wait, side.next_due())

    def summary(self, side: str) -> dict[str, Any]:
        """Return how long it ran, how its turns were kept, and what took time."""
        return {
            "duration_s": self.clock.now() - self.start_s,
            "stages": {side: self.stages.summary()},
            "machine": {side: self._keeping_up.summary()},
            "pacing": {side: self.pacer.summary() | {"garbage": self._collection.summary()}},
        }
