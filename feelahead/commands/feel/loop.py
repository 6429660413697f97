"""Loop around one controller without a robot: effects go in, states and typed characters come out."""

import contextlib
import os
import select
import sys
import time
from collections.abc import Callable, Iterator
from typing import Final, Protocol

from common.clock import Clock, VirtualClock
from common.command.stop_signal import StopSignal
from operator_side.controller.connection import Connection
from operator_side.controller.feel import Feel
from operator_side.controller.port import OpenController
from operator_side.controller.state import ControllerState
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.dualsense.hid.second_writer import SecondWriters

_POLL_S: Final = 0.004
_GUARD_PERIOD_S: Final = 0.5

Typed = Callable[[], str | None]
"""Function that returns the characters typed since the last call, without waiting; None once no more can come"""


class Activity(Protocol):
    """What is done with the controller."""

    @property
    def feel(self) -> Feel:
        """Effects of this moment."""

    def found(self, controller: OpenController) -> None:
        """Note that a controller was found."""

    def turn(self, state: ControllerState | None, typed: str | None, now_s: float) -> bool:
        """Take a new state, if there is one, and typed characters; return False to end."""

    def note(self, text: str) -> None:
        """Show a line that stays."""


class Effects:
    """Effects that the controller has, as far as is known; a listener of the connection."""

    def __init__(self) -> None:
        self.written: Feel | None = None

    def controller_found(self, now_s: float) -> None:
        """Forget the effects, so that they are written again."""
        del now_s
        self.written = None

    def controller_lost(self, now_s: float) -> None:
        """Forget the effects."""
        self.controller_found(now_s)


class Desk:
    """Controller, the effects that it has, and the watchdog that releases it when this process dies or hangs."""

    def __init__(self, connection: Connection, effects: Effects, guard: ReleaseGuard | None) -> None:
        self._connection, self._effects, self._guard = connection, effects, guard
        self._found, self._guard_s = 0, 0.0
        self._writers = SecondWriters()

    def turn(self, activity: Activity, typed: str | None, now_s: float) -> bool:
        """Read, let the activity take part, and write; return False if the activity has ended."""
        connection = self._connection
        connection.beat(now_s)
        connection.update(now_s)
        if connection.controller is not None and connection.found != self._found:
            self._found = connection.found
            activity.found(connection.controller)
        goes_on = activity.turn(connection.read(now_s), typed, now_s)
        feel = activity.feel
        if feel != self._effects.written and connection.write(feel, now_s):
            self._effects.written = feel
        for text in self._notes(now_s):
            activity.note(text)
        return goes_on

    def _notes(self, now_s: float) -> list[str]:
        notes = self._connection.take_notes()
        if self._guard is not None and now_s >= self._guard_s:
            self._guard_s = now_s + _GUARD_PERIOD_S
            notes += self._guard.take_notes()
        controller = self._connection.controller
        return notes + self._writers.search(None if controller is None else controller.path, now_s)


def live(desk: Desk, activity: Activity, typed: Typed, clock: Clock, stop: StopSignal) -> None:
    """Run until the activity ends or a stop signal comes."""
    while not stop.is_set and desk.turn(activity, typed(), clock.now()):
        if isinstance(clock, VirtualClock):
            clock.advance_to(clock.now() + _POLL_S)
        else:
            time.sleep(_POLL_S)


@contextlib.contextmanager
def typing(*, keys: bool) -> Iterator[Typed]:
    """Read standard input. keys: each key at once and unseen, only from a terminal; else whole lines from anywhere."""
    if sys.stdin is None or (keys and not sys.stdin.isatty()):
        yield lambda: "" if keys else None
        return
    descriptor = sys.stdin.fileno()
    with _each_key(descriptor) if keys else contextlib.nullcontext():
        yield lambda: _typed(descriptor)


def _typed(descriptor: int) -> str | None:
    if not select.select([descriptor], [], [], 0.0)[0]:
        return ""
    try:
        return os.read(descriptor, 4096).decode(errors="replace") or None
    except OSError:  # its terminal has been closed
        return None


@contextlib.contextmanager
def _each_key(descriptor: int) -> Iterator[None]:
    import termios  # noqa: PLC0415  # not on Windows
    import tty  # noqa: PLC0415

    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)  # Ctrl-C stays a signal
        yield
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
