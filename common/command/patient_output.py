"""Output stream that never blocks while its context is open: if the reader stalls, texts are dropped."""

import contextlib
import io
import os
import queue
import select
import threading
from collections.abc import Callable
from typing import Final, TextIO

_WAITING: Final = 64
"""Maximum number of waiting texts; beyond it the oldest is dropped."""
_END_S: Final = 0.5
"""Longest time, in seconds, for which the end of the context waits for the thread to write the last texts."""


class PatientOutput(io.TextIOBase):
    """Stream to which a thread writes while the context is open, and which is written directly afterwards.

    Results are written after the context: behind all waiting texts, as fast as the reader takes them. If the reader has
    ended (a broken pipe), a later write raises the error, but only within the context, where it ends a run.

    The stream's buffer is not used, because a flush at the end would wait for the thread.
    """

    def __init__(self, stream: TextIO | None) -> None:
        """`stream` None: drop all texts."""
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
        """Encoding of the underlying stream."""
        return getattr(self._stream, "encoding", None) or "utf-8"

    def isatty(self) -> bool:
        """Return whether the underlying stream is a terminal."""
        return self._stream is not None and self._stream.isatty()

    def write(self, text: str) -> int:
        """Queue a text, which is written whole or dropped. After an error, raise it once; drop all further texts."""
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
    """Return a function that writes a text to `stream` without buffering; None: one that drops it."""
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
