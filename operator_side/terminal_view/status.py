"""The terminal view in the place of the status line: the same calls, drawn by a process that nobody waits for."""

import os
import sys
import termios
from collections.abc import Mapping
from types import TracebackType
from typing import Final, Self

import msgspec

from common.command.live_view import Value
from common.command.status import Status
from common.companion.process import Companion
from common.errors import ConfigurationError
from operator_side.facts import OperatorFacts
from operator_side.terminal_view.terminal import put_back

_PERIOD_S: Final = 0.1
_END_LIMIT_S: Final = 0.5
_ROOM_BYTES: Final = 1 << 18
"""Some seconds of facts, for a terminal that stalls."""


class TerminalStatus(Status):
    """Shows facts on the whole terminal while the context is open; notes after it are results, written as ever."""

    def __init__(self, program: str) -> None:
        """ConfigurationError unless standard output is a terminal."""
        super().__init__("line", program)
        if not sys.stdout.isatty():
            raise ConfigurationError("--tui: standard output is no terminal; valid: a terminal, or no --tui")
        if os.environ.get("TERM", "dumb") == "dumb":
            raise ConfigurationError("--tui: TERM names a terminal without a cursor; valid: TERM=xterm, as a rule")
        self._companion: Companion | None = None
        self._encoder = msgspec.msgpack.Encoder()

    def __enter__(self) -> Self:
        self._terminal = sys.stdout.fileno()
        self._before = termios.tcgetattr(self._terminal)
        self._companion = Companion("operator_side.terminal_view.main", room_bytes=_ROOM_BYTES, output=self._terminal)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._give_up()

    @property
    def wants_facts(self) -> bool:
        """Always."""
        return True

    def show(self, now_s: float, values: Mapping[str, Value]) -> None:
        """Show nothing: the same values are in the facts."""
        del values
        self._next_s = now_s + _PERIOD_S

    def show_facts(self, facts: OperatorFacts) -> None:
        """Have them drawn, or dropped while the terminal stalls."""
        self._tell(facts)

    def note(self, text: str) -> None:
        """Show a line for a while; after the context, for good."""
        if self._companion is None:
            super().note(text)
        else:
            self._tell(text)

    def _tell(self, said: OperatorFacts | str) -> None:
        if self._companion is not None:
            self._companion.channel.send(self._encoder.encode(said))
            if self._companion.channel.ended:
                self._give_up()

    def _give_up(self) -> None:
        """End the process that draws, and put the terminal back where it could not do so itself."""
        companion, self._companion = self._companion, None
        if companion is not None:
            companion.close(_END_LIMIT_S)
            put_back(self._terminal, self._before)
