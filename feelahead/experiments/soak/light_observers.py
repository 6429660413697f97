"""Observers in the asking process: operator sides with sockets, but with neither controller nor loop of their own.

A process each would take a tenth of a core. These are driven in turn, seldom, and do what an observer does on the
wire: they ask for the arm, take what the robot side sends to those who wait, and say that they are alive.
"""

import secrets
from collections.abc import Sequence
from contextlib import ExitStack
from types import TracebackType

from common.clock import clock_domain
from common.sockets.operator import OperatorSockets
from operator_side.core import OperatorSide

PERIOD_S = 0.02
"""As often as the robot side tells observers what they may feel."""


class LightObservers:
    """`count` of them, connected while the context is open."""

    def __init__(self, count: int, control: str, view: str) -> None:
        self._count, self._endpoints = count, (control, view)
        self._sides: Sequence[tuple[OperatorSockets, OperatorSide]] = ()
        self._stack = ExitStack()

    def __enter__(self) -> "LightObservers":
        with ExitStack() as stack:
            self._sides = [
                (
                    stack.enter_context(OperatorSockets(*self._endpoints)),
                    OperatorSide(secrets.randbits(53), clock_domain(), haptics=False),
                )
                for _ in range(self._count)
            ]
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def turn(self, now_s: float) -> None:
        """Take what has come, and send what is due."""
        for sockets, side in self._sides:
            for payload in sockets.receive():
                side.receive(payload, now_s)
            for _, payload in sockets.receive_view():
                side.receive_view(payload, now_s)
            for payload in side.motion(now_s):
                sockets.send(payload)

    @property
    def arrived(self) -> bool:
        """Whether each of them knows where it stands, and sees the robot."""
        return all(side.lease is not None and side.screen is not None for _, side in self._sides)
