"""Stop signals, turned into a flag that the main loop reads, so that a run ends in an orderly way."""

import os
import select
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Final

from common.errors import ConfigurationError
from common.files.output_file import write_json

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end a run in an orderly way, SIGHUP (a closed terminal) too: the triggers must not stay stiff."""
_NEVER_BEGAN: Final = {"duration_s": 0.0, "ticks": 0, "stops": [], "errors": []}


class StopSignal:
    """Flag that any of STOP_SIGNALS sets while the context is open; afterwards the old handlers are restored."""

    def __init__(self) -> None:
        self.is_set = False

    def __enter__(self) -> "StopSignal":
        self._previous = {number: signal.signal(number, self._handle) for number in STOP_SIGNALS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        self.is_set = True


def ignore_broken_output() -> None:
    """Drop standard output after its reader has ended, so that the interpreter's last flush raises no error."""
    sys.stdout = None


def say_output_failed(program: str, error: OSError) -> int:
    """Report in one line that standard output cannot be written, as on a full disk; return the exit code."""
    ignore_broken_output()
    sys.stderr.write(f"{program}: the output cannot be written: {error.strerror}; valid: an output with enough room\n")
    return 1


class LeavingAtOnce:
    """Handler of stop signals that ends the process at once, with code 0, until a `StopSignal` is opened.

    A handler that raises an exception would not do: a module that is being imported could catch it, or a compiler's
    callback could lose it, and the process would continue.
    """

    def __init__(self, summary: str | Path | None = None) -> None:
        self.summary = summary
        """File to which to write the summary of a run that never began; None if there is none, or the run has begun"""
        for number in STOP_SIGNALS:
            signal.signal(number, self._leave)

    def _leave(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        code = 0
        if self.summary is not None:
            try:
                write_json("--summary", Path(self.summary), _NEVER_BEGAN)
            except ConfigurationError as error:
                os.write(2, f"{error}\n".encode())
                code = 2
        if os.isatty(1) and select.select([], [1], [], 0.0)[1]:
            os.write(1, b"\x1b[?25h")  # a live line hides the cursor
        os._exit(code)
