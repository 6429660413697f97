"""MCAP file, through foxglove-sdk: a chunk a second, each complete on the disk before the next begins."""

import json
import logging
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import foxglove
from foxglove import channels
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from common.recording.wire import BINARY, ENCODING, PROFILE, schema_of

_NANOSECONDS: Final = 1e9

# A failure to write is kept in `error`; the recorder reports it once.
logging.getLogger("foxglove").setLevel(logging.CRITICAL)


class RecordingFile:
    """New file. A failure to write is kept in `error`; from then on nothing is written, and nothing raises."""

    def __init__(self, path: Path, wall_offset_s: float) -> None:
        """`wall_offset_s`: wall clock minus stamps, in seconds. Raises FileExistsError if the file exists."""
        self.error: str | None = None
        self.kept_bytes = 0
        """Length up to the end of the last whole chunk"""
        self.kept_s = 0.0
        """Time from the first message to the last one of that chunk"""
        self._first_s: float | None = None
        self._last_s = 0.0
        self._offset_s = wall_offset_s
        self._output = _Output(path)
        self._context = foxglove.Context()
        self._channels: dict[str, Any] = {}
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
        """Write values of the whole file."""
        if self.error is None:
            self._attempt(lambda: self._writer.write_metadata(name, dict(values)))

    def write(self, topic: str, now_s: float, content: bytes) -> None:
        """Write a message of one of our topics."""
        self._log(topic, now_s, content, lambda: self._own_channel(topic, content))

    def draw(self, topic: str, now_s: float, content: Any) -> None:
        """Write a message of one of Foxglove's types."""
        kind = getattr(channels, f"{type(content).__name__}Channel")
        self._log(topic, now_s, content, lambda: kind(topic, context=self._context))

    def _log(self, topic: str, now_s: float, content: Any, make: Callable[[], Any]) -> None:
        """Write a message; `make` makes the topic's channel for its first one."""
        if self.error is not None:
            return
        if topic not in self._channels:
            self._channels[topic] = make()
        self._first_s = now_s if self._first_s is None else min(self._first_s, now_s)
        self._last_s = max(self._last_s, now_s)
        self._attempt(lambda: self._channels[topic].log(content, log_time=self.wall_ns(now_s)))

    def wall_ns(self, now_s: float) -> int:
        """Return the wall clock's nanoseconds at a stamp."""
        return max(0, round((now_s + self._offset_s) * _NANOSECONDS))

    def flush(self) -> None:
        """End the chunk: all that was written survives the process."""
        if self.error is None and self._attempt(self._writer.flush):
            self.kept_bytes = self._output.end
            self.kept_s = 0.0 if self._first_s is None else self._last_s - self._first_s

    def close(self) -> None:
        """Finish the file with its index; after a failure, cut it to the last whole chunk."""
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
        """Return seconds and bytes that are known to be on the disk, and the error if any."""
        return {"kept_s": self.kept_s, "bytes": self.kept_bytes, "error": self.error}

    def _own_channel(self, topic: str, first: bytes) -> foxglove.Channel:
        if topic in BINARY:
            schema = foxglove.Schema(name=BINARY[topic], encoding="", data=b"")
            return foxglove.Channel(topic, schema=schema, message_encoding=ENCODING, context=self._context)
        return foxglove.Channel(topic, schema=schema_of(topic, json.loads(first)), context=self._context)

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
    """File for the library to write to; remembers why a write failed."""

    def __init__(self, path: Path) -> None:
        self.error: str | None = None
        self.end = 0
        self._given_up = False
        self._position = 0
        """Position that the library expects: it panics at any other"""
        self._file = path.open("xb", buffering=0)

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
