"""Recordings read, whole or cut off anywhere: up to the last complete second.

The file is gone through record by record, as an index stands at the end, where a cut file has none.
"""

import io
import json
import os
import struct
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from common.errors import ConfigurationError
from common.recording.packages import require_packages
from common.recording.topics import FORMAT, PROFILE

_MAGIC: Final = b"\x89MCAP0\r\n"
_RECORD: Final = struct.Struct("<BQ")
_SPAN: Final = struct.Struct("<QQ")
"""The beginning of a chunk: its first and last stamp"""
_METADATA: Final = 0x0C
_CHUNK: Final = 0x06
_DATA_END: Final = 0x0F
_SIDES: Final = ("robot", "operator")


class Message(NamedTuple):
    """One message of the file."""

    topic: str
    log_ns: int
    """Nanoseconds on the wall clock"""
    content: bytes


@dataclass(frozen=True)
class Recording:
    """A file that has been looked through."""

    path: Path
    headers: Mapping[str, Mapping[str, Any]]
    """Settings and versions that each recorded side's core was made from, by side"""
    whole: bool
    """Whether it was finished; else it ends at the last complete second"""
    damaged: bool = False
    """Whether a chunk is not as it was written; what follows it is left"""
    end_ns: int = 0
    """The last stamp of the chunks before that, nanoseconds on the wall clock"""

    def began_ns(self) -> int:
        """The first message's stamp on the wall clock, nanoseconds; 0 without one."""
        return next((message.log_ns for message in self.messages()), 0)

    def length_s(self) -> float:
        """From the first message to the last one in a chunk that is there, seconds."""
        return 1e-9 * (self.end_ns - self.began_ns()) if self.end_ns else 0.0

    def messages(self, topics: Collection[str] = ()) -> Iterator[Message]:
        """Every message in the file's order, which is nearly that of time; of `topics` only, if any are named."""
        from mcap.records import Channel  # noqa: PLC0415
        from mcap.records import Message as Logged  # noqa: PLC0415

        names: dict[int, str] = {}
        for _, chunk in _records(self.path, (_CHUNK,)):
            records = _broken_up(chunk)
            if records is None:
                return
            for record in records:
                if isinstance(record, Channel):
                    names[record.id] = record.topic
                elif isinstance(record, Logged):
                    topic = names.get(record.channel_id, "")
                    if not topics or topic in topics:
                        yield Message(topic, record.log_time, record.data)


def open_recording(path: Path) -> Recording:
    """Look through the file at `path`; ConfigurationError, in one line, for what is no recording of ours."""
    require_packages("a recording", "foxglove", "mcap")
    headers: dict[str, Mapping[str, Any]] = {}
    whole, damaged, end_ns = False, False, 0
    for opcode, content in _records(path, (_METADATA, _CHUNK, _DATA_END)):
        if opcode == _METADATA:
            name, values = _described(path, content)
            side = name.removeprefix(f"{PROFILE}.")
            if side in _SIDES and side != name:
                headers[side] = _header(path, values)
        elif opcode == _CHUNK and not damaged:
            damaged = _broken_up(content) is None
            end_ns = end_ns if damaged else max(end_ns, _SPAN.unpack_from(content)[1])
        whole |= opcode == _DATA_END
    if not headers:
        raise ConfigurationError(
            f"{path}: holds nothing that feelahead recorded; valid: a file that --record made, of a second or more"
        )
    return Recording(path, headers, whole, damaged, end_ns)


def _described(path: Path, content: bytes) -> tuple[str, Mapping[str, str]]:
    """Read a name with texts that hold for the whole file."""
    from mcap.records import Metadata  # noqa: PLC0415

    try:
        metadata = Metadata.read(_stream(content))
    # As with chunks: the library says in many ways that bytes are not what they were.
    except Exception as error:
        raise ConfigurationError(
            f"{path}: what it says of itself is damaged; valid: a file as --record made it"
        ) from error
    return metadata.name, metadata.metadata


def _broken_up(chunk: bytes) -> list[Any] | None:
    """The records of a chunk; None for one that is not as it was written."""
    from mcap.records import Chunk  # noqa: PLC0415
    from mcap.stream_reader import breakup_chunk  # noqa: PLC0415

    try:
        return breakup_chunk(Chunk.read(_stream(chunk)), validate_crc=True)
    # What a flipped bit does is the decompressor's to say, in classes of its own.
    except Exception:
        return None


def _header(path: Path, values: Mapping[str, str]) -> dict[str, Any]:
    if values.get("format") != str(FORMAT):
        raise ConfigurationError(f"{path}: recorded in format {values.get('format')}; valid: {FORMAT}")
    return {name: _value(text) for name, text in values.items()}


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def _records(path: Path, wanted: Collection[int]) -> Iterator[tuple[int, bytes]]:
    """Each whole record of a wanted kind, as (opcode, content)."""
    try:
        if path.is_fifo():
            raise ConfigurationError(f"{path}: cannot be read: it is a pipe; valid: a recording's file")
        file = path.open("rb")
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror}; valid: a recording") from error
    with file:
        size = os.fstat(file.fileno()).st_size
        try:
            magic = file.read(len(_MAGIC))
        except OSError as error:
            raise ConfigurationError(f"{path}: cannot be read: {error.strerror}; valid: a recording") from error
        if magic != _MAGIC:
            raise ConfigurationError(f"{path}: is no MCAP file; valid: a file that --record made")
        while len(head := file.read(_RECORD.size)) == _RECORD.size:
            opcode, length = _RECORD.unpack(head)
            if file.tell() + length > size:
                return  # it was being written
            if opcode in wanted:
                yield opcode, file.read(length)
            else:
                file.seek(length, os.SEEK_CUR)
            if opcode == _DATA_END:
                return


def _stream(content: bytes) -> Any:
    from mcap.data_stream import ReadDataStream  # noqa: PLC0415

    return ReadDataStream(io.BytesIO(content))
