"""Stop signals as a flag that the main loop reads, so that every exit is clean."""

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
"""Signals that end a run, also a closed terminal: a controller must not keep stiff triggers."""
_NEVER_BEGAN: Final = {"duration_s": 0.0, "ticks": 0, "stops": [], "errors": []}


class StopSignal:
    """Flag that STOP_SIGNALS set while the context is open; the old handlers are restored after it."""

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
    """Prevent an error of the interpreter's last flush, after the reader of standard output has ended."""
    sys.stdout = None


def say_output_failed(program: str, error: OSError) -> int:
    """Report in one line that standard output cannot be written, as on a full disk; return the exit code."""
    ignore_broken_output()
    sys.stderr.write(f"{program}: the output cannot be written: {error.strerror}; valid: a place with room for it\n")
    return 1


class LeavingAtOnce:
    """Handler that ends the process at once on a stop signal, with code 0, until a `StopSignal` opens.

    An exception could be caught by a half-imported module, or lost in a compiler's callback, and the process would
    continue.
    """

    def __init__(self, summary: str | Path | None = None) -> None:
        self.summary = summary
        """File for the summary of a run that never began; None after its begin"""
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
