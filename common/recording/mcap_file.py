"""MCAP file, written through foxglove-sdk in chunks of about a second, each completed before the next begins."""

import logging
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import foxglove
from foxglove import channels
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from common.recording.topics import TYPES, json_schema
from common.recording.wire import BINARY, ENCODING, PROFILE

_NANOSECONDS: Final = 1e9

# A failure to write is kept in `error`; the recorder reports it once.
logging.getLogger("foxglove").setLevel(logging.CRITICAL)


class RecordingFile:
    """New MCAP file. If writing fails, the reason is kept in `error`; nothing more is written, and no call raises."""

    def __init__(self, path: Path, wall_offset_s: float) -> None:
        """`wall_offset_s`: wall clock minus the clock of `now_s`, in seconds. FileExistsError if the file exists."""
        self.error: str | None = None
        self.kept_bytes = 0
        """Length of the file up to the end of the last complete chunk"""
        self.kept_s = 0.0
        """Time from the first message of the file to the last message of that chunk, in seconds"""
        self._first_s: float | None = None
        self._last_s = 0.0
        self._offset_s = wall_offset_s
        self._output = _Output(path)
        self._context = foxglove.Context()
        self._channels: dict[str, Any] = {}
        self.schemas = {topic: json_schema(topic, kind) for topic, kind in TYPES.items()}
        """JSON schemas by topic; a topic without one is written as JSON of any form"""
        self._writer = foxglove.open_mcap(
            self._output,
            context=self._context,
            writer_options=MCAPWriteOptions(
                profile=PROFILE,
                compression=MCAPCompression.Zstd,
                # `flush` ends each chunk.
                chunk_size=None,
                compression_threads=0,
            ),
        )
        self._closed = False

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Write named values that describe the whole file, as MCAP metadata."""
        if self.error is None:
            self._attempt(lambda: self._writer.write_metadata(name, dict(values)))

    def write(self, topic: str, now_s: float, content: bytes) -> None:
        """Write a message in our own encoding: binary for a topic in BINARY, else JSON."""
        self._log(topic, now_s, content, lambda: self._own_channel(topic))

    def draw(self, topic: str, now_s: float, content: Any) -> None:
        """Write a message `content` of one of Foxglove's types."""
        kind = getattr(channels, f"{type(content).__name__}Channel")
        self._log(topic, now_s, content, lambda: kind(topic, context=self._context))

    def _log(self, topic: str, now_s: float, content: Any, make: Callable[[], Any]) -> None:
        """Write a message; for the first of a topic, `make` makes the topic's channel."""
        if self.error is not None:
            return
        if topic not in self._channels:
            self._channels[topic] = make()
        self._first_s = now_s if self._first_s is None else min(self._first_s, now_s)
        self._last_s = max(self._last_s, now_s)
        self._attempt(lambda: self._channels[topic].log(content, log_time=self.wall_ns(now_s)))

    def wall_ns(self, now_s: float) -> int:
        """Return the wall clock's time at the stamp `now_s`, in nanoseconds."""
        return max(0, round((now_s + self._offset_s) * _NANOSECONDS))

    def flush(self) -> None:
        """End the chunk, so that all that was written is in the file even if the process ends now."""
        if self.error is None and self._attempt(self._writer.flush):
            self.kept_bytes = self._output.end
            self.kept_s = 0.0 if self._first_s is None else self._last_s - self._first_s
        if self.error is None and self._output.deleted:
            self.error, self.kept_bytes, self.kept_s = "the file was deleted", 0, 0.0

    def close(self) -> None:
        """Finish the file with its index; after a failure, cut it off after the last complete chunk."""
        if self._closed:
            return
        self._closed = True
        if self.error is None:
            self.flush()
        if self.error is None and self._attempt(self._writer.close):
            self.kept_bytes = self._output.end
        if self.error is not None:
            self._output.give_up()
            self._attempt(self._writer.close)
        self._output.finish(None if self.error is None else self.kept_bytes)

    def figures(self) -> dict[str, Any]:
        """Return how many seconds and bytes are in complete chunks, and the error, if any."""
        return {"kept_s": self.kept_s, "bytes": self.kept_bytes, "error": self.error}

    def _own_channel(self, topic: str) -> foxglove.Channel:
        if topic in BINARY:
            schema = foxglove.Schema(name=BINARY[topic], encoding="", data=b"")
            return foxglove.Channel(topic, schema=schema, message_encoding=ENCODING, context=self._context)
        return foxglove.Channel(topic, schema=self.schemas.get(topic), message_encoding="json", context=self._context)

    def _attempt(self, write: Any) -> bool:
        try:
            write()
        # The library turns OSError into RuntimeError, in its words.
        except (RuntimeError, OSError) as error:
            if self.error is None:
                self.error = self._output.error or str(error)
            return False
        # The library may swallow the failure of a message within a chunk, and fail again at each later one.
        if self.error is None:
            self.error = self._output.error
        return self._output.error is None


class _Output:
    """File to which the library writes; it remembers why a write failed."""

    def __init__(self, path: Path) -> None:
        self.error: str | None = None
        self.end = 0
        self._given_up = False
        self._position = 0
        """Position that the library expects; at any other it panics"""
        self._file = path.open("xb", buffering=0)

    @property
    def deleted(self) -> bool:
        return os.fstat(self._file.fileno()).st_nlink == 0

    def write(self, data: bytes | bytearray) -> int:
        if not self._given_up:
            self._write(data)
        self._position += len(data)
        return len(data)

    def _write(self, data: bytes | bytearray) -> None:
        left = memoryview(data)
        try:
            # A part may fit; the next write raises the reason why the rest does not.
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            self.error = error.strerror or str(error)
            # The library writes all of it again: the part that fitted must not precede it.
            self._file.seek(self._position)
            raise
        self.end = max(self.end, self._position + len(data))

    def seek(self, offset: int, whence: int = 0) -> int:
        if self._given_up and whence != os.SEEK_END:
            self._position = offset if whence == os.SEEK_SET else self._position + offset
        else:
            self._position = self._file.seek(offset, whence)
        return self._position

    def flush(self) -> None:
        """Do nothing: the file is unbuffered."""

    def give_up(self) -> None:
        self._given_up = True

    def finish(self, length: int | None) -> None:
        if length is not None:
            self._file.truncate(length)
        self._file.close()
