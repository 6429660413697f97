"""Loop around one controller without a robot: effects go in, states and typed characters come out."""

import contextlib
import math
import os
import select
import sys
import time
from collections.abc import Callable, Iterator
from typing import Final, Protocol

from rich.console import Console, RenderableType
from rich.live import Live

from common.clock import Clock, VirtualClock
from common.command.stop_signal import StopSignal
from operator_side.controller.connection import Connection
from operator_side.controller.feel import Feel
from operator_side.controller.port import OpenController
from operator_side.controller.search import BackgroundSearch
from operator_side.controller.state import ControllerState
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.dualsense.hid.second_writer import SecondWriters

_POLL_S: Final = 0.004
_GUARD_PERIOD_S: Final = 0.5
_SHOW_S: Final = 0.05
_MEANWHILE: Final = "it goes on when the controller is back"

Typed = Callable[[], str | None]
"""Function that returns the characters typed since the last call, without waiting; None once no more can come"""


class Activity(Protocol):
    """What is done with the controller."""

    @property
    def feel(self) -> Feel:
        """Effects of this moment."""

    def found(self, controller: OpenController) -> None:
        """Note that a controller was found, for the first time or again."""

    def turn(self, state: ControllerState | None, typed: str | None, now_s: float) -> bool:
        """Take a new state, if there is one, and typed characters; return False to end."""

    def finish(self) -> list[str] | None:
        """Store the result, and return it in words; None if it was given up."""


class Screen:
    """Lines that stay, and on a terminal a drawing below them."""

    def __init__(self, console: Console) -> None:
        self.draws: Final = console.is_terminal
        """Whether drawings are shown."""
        self._console, self._shown_s = console, -math.inf
        self._live = Live(console=console, auto_refresh=False)

    def say(self, text: str) -> None:
        """Print a line above the drawing."""
        self._console.print(text, markup=False, highlight=False, soft_wrap=not self.draws)

    def draw(self, drawing: Callable[[], RenderableType], now_s: float) -> None:
        """Show the drawing, if one is due."""
        if self.draws and now_s >= self._shown_s + _SHOW_S:
            self._shown_s = now_s
            self._live.start()
            self._live.update(drawing(), refresh=True)

    def close(self) -> None:
        """Leave the last drawing on the terminal."""
        self._live.stop()


class Desk:
    """Connection to the controller, the effects that it has, and the watchdog that releases it if this process dies."""

    def __init__(self, search: BackgroundSearch, guard: ReleaseGuard | None, screen: Screen) -> None:
        self._connection = Connection(search, self, guard, _MEANWHILE)
        self._guard, self._screen = guard, screen
        self._found, self._guard_s = 0, 0.0
        self._written: Feel | None = None
        self._writers = SecondWriters()

    def controller_found(self, now_s: float) -> None:
        """Forget the effects, so that they are written again."""
        del now_s
        self._written = None

    controller_lost = controller_found

    def live(self, activity: Activity, typed: Typed, clock: Clock, stop: StopSignal) -> None:
        """Run until the activity ends or a stop signal comes; then release and close the controller."""
        try:
            while not stop.is_set and self._turn(activity, typed(), clock.now()):
                if isinstance(clock, VirtualClock):
                    clock.advance_to(clock.now() + _POLL_S)
                else:
                    time.sleep(_POLL_S)
        finally:
            self._connection.close()

    def _turn(self, activity: Activity, typed: str | None, now_s: float) -> bool:
        """Read, let the activity take part, and write; return False if the activity has ended."""
        connection = self._connection
        connection.beat(now_s)
        connection.update(now_s)
        controller = connection.controller
        notes = connection.take_notes()
        if self._guard is not None and now_s >= self._guard_s:
            self._guard_s = now_s + _GUARD_PERIOD_S
            notes += self._guard.take_notes()
        for text in notes + self._writers.search(None if controller is None else controller.path, now_s):
            self._screen.say(text)
        if controller is not None and connection.found != self._found:
            self._found = connection.found
            activity.found(controller)
        goes_on = activity.turn(connection.read(now_s), typed, now_s)
        if (feel := activity.feel) != self._written and connection.write(feel, now_s):
            self._written = feel
        return goes_on


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
