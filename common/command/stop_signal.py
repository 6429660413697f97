"""SIGINT and SIGTERM as a flag that the main loop reads, so that every exit goes the same clean way."""

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
"""A closed terminal, too: a controller must not be left with stiff triggers."""
_NEVER_BEGAN: Final = {"duration_s": 0.0, "ticks": 0, "stops": [], "errors": []}


class StopSignal:
    """Set by SIGINT or SIGTERM while the context is open; the old handlers come back after it."""

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
    """After a reader of our standard output went away: keep the interpreter's last flush from complaining."""
    sys.stdout = None


def say_output_failed(program: str, error: OSError) -> int:
    """After our standard output could not be written, as on a full disk: one line, and the exit code."""
    ignore_broken_output()
    sys.stderr.write(f"{program}: the output cannot be written: {error.strerror}; valid: a place with room for it\n")
    return 1


class LeavingAtOnce:
    """Lets a stop signal end the process on the spot, with code 0, until a `StopSignal` opens.

    An exception could be caught by a module that is half imported, or lost in a compiler's callback, and the process
    would go on.
    """

    def __init__(self, summary: str | Path | None = None) -> None:
        self.summary = summary
        """File for the summary of a run that never began; None once it has begun"""
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
