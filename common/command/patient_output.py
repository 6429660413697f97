"""Output stream that never blocks while its context is open: a stalled reader loses texts that do not fit."""

import contextlib
import io
import os
import queue
import select
import threading
from collections.abc import Callable
from typing import Final, TextIO

_WAITING: Final = 64
"""Number of texts that may wait; the oldest is dropped for another."""
_END_S: Final = 0.5
"""Longest wait of the context's end for the last text, in seconds."""


class PatientOutput(io.TextIOBase):
    """Stream that is written by a thread while the context is open, and directly after it.

    Results are written after it: behind all waiting texts, at the reader's speed. The end of the reader raises an
    error only within the context, at a later write: there it ends a run.

    The stream's buffer is not used: a flush at the end would wait for the thread.
    """

    def __init__(self, stream: TextIO | None) -> None:
        """`stream` None drops everything."""
        self._stream = stream
        self._sink = _sink(stream)
        self._failure: Exception | None = None
        self._open = False
        self._waiting: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        # A daemon: a write that never returns must not keep the process alive.
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
        """Encoding of the stream."""
        return getattr(self._stream, "encoding", None) or "utf-8"

    def isatty(self) -> bool:
        """Return whether the stream is a terminal."""
        return self._stream is not None and self._stream.isatty()

    def write(self, text: str) -> int:
        """Queue a text to be written whole or dropped. Raises an earlier write's error once; then all is dropped."""
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
    """Return a function that writes a text to `stream` at once."""
    if stream is None:
        return len
    try:
        stream.flush()
        descriptor = stream.fileno()
    except io.UnsupportedOperation:
        return stream.write  # in memory, which never stalls

    def write(text: str) -> None:
        left = text.encode(stream.encoding, stream.errors or "strict")
        while left:
            try:
                left = left[os.write(descriptor, left) :]
            except BlockingIOError:  # another program with the same file has made it non-blocking
                select.select([], [descriptor], [])

    return write
