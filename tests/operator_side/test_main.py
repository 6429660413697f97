"""The operator's loop on a virtual clock: what waited while the process was stopped is as old as it is."""

from typing import Any, Self

import pytest

import operator_side.main
from common.clock import VirtualClock
from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from operator_side.core import OperatorSide
from tests.helpers.felt import felt

STOPPED_S = 5.0


class Sockets:
    """A robot side that says something once, and a process that is stopped while it waits to be read."""

    trouble = None

    def __init__(self, clock: VirtualClock) -> None:
        self._clock, self._robot, self._calls = clock, LinkEnd("robot", 1, "clock"), 0

    def receive(self) -> list[bytes]:
        self._calls += 1
        if self._calls != 3:
            return []
        said = [encode(self._robot.hello(self._clock.now())), encode(felt(self._robot.stamp(self._clock.now()), r2=8))]
        self._clock.advance_to(self._clock.now() + STOPPED_S)
        return said

    def receive_view(self) -> list[tuple[bytes, bytes]]:
        return []

    def send(self, payload: bytes, *, everywhere: bool = False) -> None:
        del payload, everywhere

    def wait(self, timeout_s: float) -> bool:
        self._clock.advance_to(self._clock.now() + max(timeout_s, 1e-5))
        return False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *ended: object) -> None: ...


def test_the_clock_is_read_after_what_has_arrived_was_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, heard = VirtualClock(), []

    class Core(OperatorSide):
        def receive(self, payload: bytes, now_s: float) -> None:
            heard.append((now_s, clock.now()))
            super().receive(payload, now_s)

    def build(*arguments: Any) -> OperatorSide:
        return Core(arguments[1], "clock")

    monkeypatch.setattr(operator_side.main, "MonotonicClock", lambda: clock)
    monkeypatch.setattr(operator_side.main, "OperatorSockets", lambda *_, **__: Sockets(clock))
    monkeypatch.setattr(operator_side.main, "build_recorded", build)
    monkeypatch.setattr(operator_side.main, "raise_priority", lambda: None)
    arguments = ["--device=simulated", "--status=none", f"--duration={STOPPED_S + 1.0}"]
    assert operator_side.main.command(arguments) == 0
    assert len(heard) == 2
    assert all(taken_s == now_s > STOPPED_S for taken_s, now_s in heard)
