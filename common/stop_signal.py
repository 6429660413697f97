"""SIGINT and SIGTERM as a flag that the main loop reads, so that every exit goes the same clean way."""

import signal
import sys
from types import FrameType, TracebackType


class StopSignal:
    """Set by SIGINT or SIGTERM while the context is open; the old handlers come back after it."""

    # A closed terminal, too: a controller must not be left with stiff triggers.
    _SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def __init__(self) -> None:
        self.is_set = False

    def __enter__(self) -> "StopSignal":
        self._previous = {number: signal.signal(number, self._handle) for number in self._SIGNALS}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def set(self) -> None:
        """Ask the loop to end, as a signal would."""
        self.is_set = True

    def _handle(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        self.is_set = True


def ignore_broken_output() -> None:
    """After a reader of our standard output went away: keep the interpreter's last flush from complaining."""
    sys.stdout = None
