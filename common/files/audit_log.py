"""Audit log: what happened at the ports and to the arm, one JSON object a line, on the disk before the next event.

A thread writes, so that no turn waits for a disk. Of a process that is killed, at most the newest event is missing.
"""

import json
import os
import queue
import stat
import threading
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Final

from common.errors import ConfigurationError

LARGEST_BYTES: Final = 1 << 20
KEPT: Final = 8
"""Size from which on a file is put aside as FILE.1, and number of files that are kept so"""
_WAITING: Final = 1000
_END_S: Final = 0.5


class AuditLog:
    """Log of events in the file `path`, which grows from run to run."""

    def __init__(self, path: Path, wall_s: Callable[[], float], largest_bytes: int = LARGEST_BYTES) -> None:
        """wall_s: time since 1970. ConfigurationError if the file cannot be written."""
        self.failed = 0
        """Number of events that are not in the file, because the disk refused, or was too slow"""
        self._told = False
        self._path, self._wall_s, self._largest_bytes = path, wall_s, largest_bytes
        try:
            descriptor = self._opened()
            regular = stat.S_ISREG(os.fstat(descriptor).st_mode)
            os.close(descriptor)
        except OSError as error:
            raise ConfigurationError(
                f"--audit {path}: cannot be written: {error.strerror}; valid: a file of this user, not a link"
            ) from error
        if not regular:
            raise ConfigurationError(f"--audit {path}: is no regular file; valid: a file of this user")
        self._waiting: queue.Queue[bytes | None] = queue.Queue(_WAITING)
        self._thread = threading.Thread(target=self._write_on, daemon=True, name="audit")
        self._thread.start()

    def note(self, event: str, **more: str | float) -> None:
        """Add an event with the present time; never waits."""
        line = json.dumps({"time_s": round(self._wall_s(), 3), "event": event} | more)
        try:
            self._waiting.put_nowait(line.encode() + b"\n")
        except queue.Full:
            self.failed += 1

    def take_failure(self) -> bool:
        """Return whether an event was lost for the first time since the last call."""
        new, self._told = self.failed > 0 and not self._told, self.failed > 0
        return new

    def close(self) -> None:
        """Write what waits, within half a second."""
        if self._thread.is_alive():
            self._waiting.put(None)
            self._thread.join(_END_S)

    def _opened(self) -> int:
        flags = os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK
        return os.open(self._path, os.O_WRONLY | flags, 0o600)

    def _write_on(self) -> None:
        while (line := self._waiting.get()) is not None:
            try:
                self._write(line)
            except OSError:
                self.failed += 1

    def _write(self, line: bytes) -> None:
        if self._path.exists() and self._path.stat().st_size + len(line) > self._largest_bytes:
            self._put_aside()
        descriptor = self._opened()
        try:
            os.write(descriptor, line)
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def _put_aside(self) -> None:
        aside = [self._path, *(self._path.with_name(f"{self._path.name}.{number}") for number in range(1, KEPT + 1))]
        for newer, older in reversed(list(pairwise(aside))):
            if newer.exists():
                newer.replace(older)
