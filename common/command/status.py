"""Status output: a story for people, above a live line in a terminal, or JSON lines for programs."""

import json
import re
import sys
import textwrap
from collections.abc import Callable
from typing import IO, Any, Literal, cast

import msgspec
from rich.console import Console
from rich.live import Live
from rich.text import Text

from common.command.live_line import live_line
from common.command.live_story import Story
from common.command.live_view import LiveView
from common.command.patient_output import PatientOutput
from common.command.words import printable
from common.status.statuses import OperatorStatus, RobotStatus, joined

StatusMode = Literal["line", "json", "facts", "none"]

_PERIOD_S = 0.2
_FACTS_PERIOD_S = 0.1
_TIME_COLUMNS = 10
"""Width of the time before each line of the story"""
_LINES_OF_JSON = ("json", "facts")


class _Console(Console):
    def on_broken_pipe(self) -> None:
        """Raise the error, so that the command handles it; Rich would end the process with code 1."""
        raise  # noqa: PLE0704  # called where the BrokenPipeError is handled


class Status:
    """Output of a run's status on standard output, a few times a second. Errors go to standard error.

    While the context is open, no call waits for the reader of the output: if the reader stalls, texts are dropped. A
    note after the context is a result, and waits for the reader.

    Texts come from others, too: their control characters become question marks, so that nobody else can write a line.
    """

    def __init__(self, mode: StatusMode, program: str) -> None:
        self._mode = mode
        self._program = program
        self._output = PatientOutput(sys.stdout)
        self._console = _Console(file=cast("IO[str]", self._output))
        self._live: Live | None = None
        self._story = Story()
        self._next_s = -1.0
        self.also: Callable[[str], None] | None = None
        """Function that also gets each note, besides the output; None for none"""

    def __enter__(self) -> "Status":
        self._output.__enter__()
        if self._mode == "line" and self._console.is_terminal:
            self._live = Live(
                console=self._console,
                auto_refresh=False,
                transient=False,
                redirect_stdout=False,
                redirect_stderr=False,  # unlike the line, errors are never dropped
            )
            self._live.start()
        return self

    def __exit__(self, *error: Any) -> None:
        try:
            if self._live is not None:
                self._live.stop()
        finally:
            self._output.__exit__(*error)

    @property
    def wants_facts(self) -> bool:
        """Whether `show_facts` shows anything. If not, the caller need not make the facts, which takes time."""
        return self._mode == "facts"

    def due(self, now_s: float) -> bool:
        """Return whether `show` would show anything now. If not, the caller need not make a status, which is slow."""
        return self._mode != "none" and now_s >= self._next_s

    def show(self, now_s: float, *, robot: RobotStatus | None = None, operator: OperatorStatus | None = None) -> None:
        """Show the status, at most five times a second, or ten in the mode "facts".

        Raises BrokenPipeError, once, if the reader of the output has ended.
        """
        if not self.due(now_s):
            return
        self._next_s = now_s + (_FACTS_PERIOD_S if self.wants_facts else _PERIOD_S)
        if self._mode in _LINES_OF_JSON:
            self._write({"event": "status", **joined(robot, operator)})
            return
        view = LiveView(robot, operator)
        reported = self._story.tell(now_s, view)
        if self._live is not None:
            if reported is not None:
                self._console.print(self._paragraph(printable(reported)), style="bold red" if view.alarm else "")
            # The last column stays free: some terminals break the line when it is filled.
            text = printable(live_line(view, self._console.width - 1))
            style = "bold red" if view.alarm else ""
            self._live.update(Text(text, style=style, overflow="crop", no_wrap=True), refresh=True)
        elif reported is not None:
            self._output.write(f"{printable(reported)}\n")

    def _paragraph(self, text: str) -> Text:
        """Break a line of the story between words, with its time in a column of its own; a unit stays at its number."""
        width = max(self._console.width - 1, _TIME_COLUMNS + 1)
        kept = re.sub(r"(?<=\d) (?=%|mm)", "\0", text)
        return Text(
            textwrap.fill(kept, width, subsequent_indent=" " * _TIME_COLUMNS).replace("\0", " "), overflow="fold"
        )

    def show_facts(self, facts: Any) -> None:
        """Write `facts`, a struct of all that the console shows, at once; only in the mode "facts"."""
        if self._mode == "facts":
            self._write({"event": "facts", "facts": facts})

    def _write(self, event: dict[str, Any]) -> None:
        # Numbers that are not finite become null.
        line = msgspec.json.encode(event).decode()
        if not line.isprintable():  # somebody may look at the lines in a terminal
            line = "".join(sign if sign.isprintable() else json.dumps(sign)[1:-1] for sign in line)
        self._output.write(f"{line}\n")

    def event(self, kind: str, **values: str | int) -> bool:
        """Write an event as one line of JSON at once. In modes without JSON, do nothing and return False."""
        if self._mode in _LINES_OF_JSON:
            self._output.write(json.dumps({"event": kind, **values}) + "\n")
        return self._mode in _LINES_OF_JSON

    def note(self, text: str) -> None:
        """Write a line for people that the live line does not overwrite; in modes with JSON, an event "note"."""
        if self.also is not None:
            self.also(text)
        if self._mode in _LINES_OF_JSON:
            self.event("note", text=text)
        elif self._mode == "line":
            # Wrapped between words for a person, left whole for a search in a file.
            whole = not self._console.is_terminal
            self._console.print(f"{self._program}: {printable(text)}", markup=False, highlight=False, soft_wrap=whole)
