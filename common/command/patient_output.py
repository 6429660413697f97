"""A stream that holds nobody up while its context is open: a reader that stalls loses what does not fit."""

import contextlib
import io
import os
import queue
import select
import threading
from collections.abc import Callable
from typing import Final, TextIO

_WAITING: Final = 64
"""Texts that wait for a reader; the oldest is dropped for one more."""
_END_S: Final = 0.5
"""The context's end waits so long for the last of them."""


class PatientOutput(io.TextIOBase):
    """Writes to a stream by a thread of its own while the context is open, and directly after it.

    Results are written after it: behind all that waits, and for as long as the reader takes. A reader that has gone is
    told within the context only, by the first write that comes later: there it ends a run.

    The stream's buffer is not used: a flush of it at the end would wait for the thread.
    """

    def __init__(self, stream: TextIO | None) -> None:
        """`stream` None drops everything."""
        self._stream = stream
        self._sink = _sink(stream)
        self._failure: Exception | None = None
        self._open = False
        self._waiting: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        # A daemon: a write that never returns must not keep the process from ending.
        self._thread = threading.Thread(target=self._write_on, daemon=True, name="output")

    def __enter__(self) -> "PatientOutput":
        self._open = True
        self._thread.start()
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._open = False
        self._waiting.put(None)
        self._thread.join(_END_S)
        if kind is None:
            self._raise_failure()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """The stream's."""
        return getattr(self._stream, "encoding", None) or "utf-8"

    def isatty(self) -> bool:
        """Whether a person reads it."""
        return self._stream is not None and self._stream.isatty()

    def write(self, text: str) -> int:
        """Have it written whole, or dropped; once, the error of an earlier one, after which all is dropped."""
        if self._open:
            if self._waiting.qsize() >= _WAITING:
                with contextlib.suppress(queue.Empty):
                    self._waiting.get_nowait()
            self._waiting.put(text)
        else:
            if self._thread.is_alive():
                self._thread.join()
            self._write(text)
        self._raise_failure()
        return len(text)

    def _raise_failure(self) -> None:
        failure, self._failure = self._failure, None
        if failure is not None and (self._open or not isinstance(failure, BrokenPipeError)):
            raise failure

    def _write_on(self) -> None:
        while (text := self._waiting.get()) is not None:
            self._write(text)

    def _write(self, text: str) -> None:
        try:
            self._sink(text)
        except (OSError, ValueError) as error:  # gone, full, or without these letters
            self._failure, self._sink = error, _sink(None)


def _sink(stream: TextIO | None) -> Callable[[str], object]:
    """Make what writes a text to `stream` at once."""
    if stream is None:
        return len
    try:
        stream.flush()
        descriptor = stream.fileno()
    except io.UnsupportedOperation:
        return stream.write  # in memory, where nothing stalls

    def write(text: str) -> None:
        left = text.encode(stream.encoding, stream.errors or "strict")
        while left:
            try:
                left = left[os.write(descriptor, left) :]
            except BlockingIOError:  # another program that has it, too, wants no write to wait
                select.select([], [descriptor], [])

    return write
