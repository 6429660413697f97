"""Terminal view (`--tui`) in place of the status line, drawn by a process that never blocks the operator side.

`python -m operator_side.viewing.terminal.status FD` is that process. It may have to wait for a slow terminal; facts
that arrive meanwhile are skipped. When the operator side closes the channel or ends, it restores the terminal and ends.
"""

import contextlib
import os
import select
import sys
import termios
from typing import Any, Final, Self

import msgspec
from rich.console import Console
from rich.live import Live

from common.clock import MonotonicClock
from common.command.status import Status
from common.companion.channel import Channel
from common.companion.process import Companion, companion_channel
from common.errors import ConfigurationError
from common.status.statuses import OperatorStatus, RobotStatus
from operator_side.viewing.facts import OperatorFacts
from operator_side.viewing.terminal.screen import Screen

_PERIOD_S: Final = 0.1
_END_LIMIT_S: Final = 0.5
_LEAVE: Final = b"\x1b[0m\x1b[?25h\x1b[?1049l"  # leave the alternate screen, and show the cursor
_INPUT, _LOCAL, _LETTERS = 0, 3, 6


class TerminalStatus(Status):
    """Status that fills the terminal while the context is open. Later notes, the run's results, are printed."""

    wants_facts: Final = True
    _companion: Companion | None = None

    def __init__(self, program: str) -> None:
        """Raise ConfigurationError unless standard output is a terminal whose cursor can be moved."""
        super().__init__("line", program)
        if not sys.stdout.isatty() or os.environ.get("TERM", "dumb") == "dumb":
            raise ConfigurationError("--tui: no terminal with a cursor; valid: a terminal and its TERM, or no --tui")

    def __enter__(self) -> Self:
        self._before = termios.tcgetattr(sys.stdout)
        self._companion = Companion("operator_side.viewing.terminal.status", output=sys.stdout.fileno())
        return self

    def __exit__(self, *ended: Any) -> None:
        """End the drawing process, and restore the terminal if that process could not."""
        companion, self._companion = self._companion, None
        if companion is not None:
            companion.close(_END_LIMIT_S)
            _put_back(self._before)

    def show(self, now_s: float, *, robot: RobotStatus | None = None, operator: OperatorStatus | None = None) -> None:
        """Draw nothing, as the facts contain both statuses; only schedule the next call."""
        del robot, operator
        self._next_s = now_s + _PERIOD_S

    def show_facts(self, facts: OperatorFacts | str) -> None:
        """Send facts, or a note, to the drawing process; they are dropped while the terminal stalls."""
        if self._companion is not None:
            self._companion.channel.send(msgspec.msgpack.encode(facts))
            if self._companion.channel.ended:
                self.__exit__()

    def note(self, text: str) -> None:
        """Show a line among the notes; once the context has ended, print it."""
        (super().note if self._companion is None else self.show_facts)(text)


def _put_back(attributes: list[Any]) -> None:
    """Restore the normal screen and its cursor, and drop what was typed. Ignore a terminal that has closed."""
    with contextlib.suppress(termios.error, OSError):
        termios.tcsetattr(sys.stdout, termios.TCSAFLUSH, attributes)
        os.write(sys.stdout.fileno(), _LEAVE)


def main() -> None:
    """Run the drawing process until the channel or the terminal ends."""
    channel, _ = companion_channel(sys.argv[1:])
    before, changed = termios.tcgetattr(sys.stdout), termios.tcgetattr(sys.stdout)
    # Ctrl-Z would leave the arm uncontrolled, and Ctrl-S an old screen that looks current.
    changed[_LETTERS][termios.VSUSP] = b"\x00"
    changed[_INPUT] &= ~termios.IXON
    changed[_LOCAL] &= ~termios.ECHO
    output = os.fdopen(sys.stdout.fileno(), "w", encoding="utf-8")
    console = Console(file=output, _environ=os.environ | {"COLUMNS": "", "LINES": ""})  # the terminal's own size
    try:
        termios.tcsetattr(sys.stdout, termios.TCSANOW, changed)
        with contextlib.suppress(OSError), Live(console=console, screen=True, auto_refresh=False) as live:
            _draw_on(channel, live)
    finally:
        _put_back(before)


def _draw_on(channel: Channel, live: Live) -> None:
    clock, decoder = MonotonicClock(), msgspec.msgpack.Decoder(OperatorFacts | str)
    screen, came_s, next_s = Screen(), clock.now(), clock.now()
    while not channel.ended:
        select.select([channel], [], [], max(0.0, next_s - clock.now()))
        for message in channel.receive():
            if isinstance(said := decoder.decode(message), str):
                screen.notes.append(said)
            else:
                screen.add(said)
                came_s = clock.now()
        if (now_s := clock.now()) >= next_s:
            next_s = now_s + _PERIOD_S
            live.update(screen.lines(now_s - came_s, live.console.width), refresh=True)


if __name__ == "__main__":
    main()
