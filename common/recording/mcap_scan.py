"""Scan of an MCAP file in any legal form: with chunks or without, in any order and compression, whole or cut off.

The file is read record by record, because its index is at the end, which a file that was cut off lacks, and optional.
"""

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple

from common.errors import ConfigurationError
from common.recording.mcap_chunk import COMPRESSIONS, records_of

_MAGIC: Final = b"\x89MCAP0\r\n"
_PART_BYTES: Final = 1 << 20
"""Length from which a part outside of chunks ends"""
_LARGEST_CHUNK: Final = 1 << 27
"""Most bytes of a chunk after unpacking; a second of ours has fewer than a tenth"""
_MOST_TIMES: Final = 200
"""Most bytes of all chunks after unpacking, in sizes of the file; one such chunk is free"""


class Part(NamedTuple):
    """Part of the file with messages: a chunk, or successive records outside of chunks."""

    start_ns: int
    """Oldest stamp"""
    begin: int
    """Position in the file"""
    end: int


@dataclass
class Scan:
    """Content of a file, up to where it is damaged or cut off."""

    path: Path
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    """Topic of each channel"""
    parts: list[Part] = field(default_factory=list)
    stamps_ns: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Oldest and newest stamp of each topic with messages"""
    whole: bool = False
    """Whether the file was finished"""
    damaged: bool = False
    _unpacked_bytes: int = 0
    _unchecked: bool = False
    """Whether there are messages that no chunk's checksum covers"""

    def read(self, file: BinaryIO) -> None:
        """Read the file to its end, or until it is damaged; ConfigurationError if it is invalid as a whole."""
        from mcap.exceptions import EndOfFile, RecordLengthLimitExceeded  # noqa: PLC0415

        if (magic := file.read(len(_MAGIC))) != _MAGIC:
            self._refuse("is no MCAP file" if magic else "is empty")
        try:
            for begin, end, record in _records(file, self.path.stat().st_size):
                self._take(file, begin, end, record)
                if self.whole:
                    return  # the rest repeats
        except (EndOfFile, RecordLengthLimitExceeded):
            return  # cut off while being written
        except (ConfigurationError, OSError):
            raise
        # Readers and decompressors report flipped bits by various classes.
        except Exception:
            self.damaged = True

    def _take(self, file: BinaryIO, begin: int, end: int, record: Any) -> None:
        from mcap.records import Channel, Chunk, DataEnd, Message, Metadata  # noqa: PLC0415

        if isinstance(record, Metadata):
            self.metadata.append((record.name, record.metadata))
        elif isinstance(record, DataEnd):
            self.whole = True
            if self._unchecked and record.data_section_crc not in (0, _checksum(file, begin)):
                self._refuse("is damaged: its checksum is another one, which does not say where", "an undamaged file")
        chunk = isinstance(record, Chunk)
        if chunk and record.compression not in COMPRESSIONS:
            self._refuse(f"is compressed by {record.compression!r}", "zstd, lz4 or none")
        if chunk:
            self._refuse_bomb(record.uncompressed_size)
        stamps = []
        for one in _inside(record):
            if isinstance(one, Channel) and self.names.setdefault(one.id, one.topic) != one.topic:
                self._refuse(f"has two topics in channel {one.id}: {self.names[one.id]} and {one.topic}", "one each")
            elif isinstance(one, Message):
                if one.channel_id not in self.names:
                    self._refuse(f"has messages in channel {one.channel_id}, which nothing before them describes")
                topic, stamp_ns = self.names[one.channel_id], one.log_time
                first_ns, last_ns = self.stamps_ns.get(topic, (stamp_ns, stamp_ns))
                self.stamps_ns[topic] = min(first_ns, stamp_ns), max(last_ns, stamp_ns)
                stamps.append(one.log_time)
        if stamps:
            self._unchecked |= not (chunk and record.uncompressed_crc)
            self._add(Part(min(stamps), begin, end), joins=not chunk)

    def _refuse_bomb(self, size: int) -> None:
        self._unpacked_bytes += size
        if size > _LARGEST_CHUNK:
            self._refuse(f"has a chunk of {size} bytes after unpacking", f"at most {_LARGEST_CHUNK}")
        if self._unpacked_bytes > _MOST_TIMES * self.path.stat().st_size + _LARGEST_CHUNK:
            self._refuse(f"unpacks to more than {_MOST_TIMES} times its size", "a file that --record made")

    def _add(self, part: Part, *, joins: bool) -> None:
        """Add a part. joins: whether it may continue the one before it."""
        last = self.parts[-1] if self.parts and joins else None
        if last is not None and last.end == part.begin and part.end - last.begin < _PART_BYTES:
            self.parts[-1] = Part(min(last.start_ns, part.start_ns), last.begin, part.end)
        else:
            self.parts.append(part)

    def _refuse(self, why: str, valid: str = "a file that --record made") -> None:
        raise ConfigurationError(f"{self.path}: {why}; valid: {valid}")


def messages_in(file: BinaryIO, part: Part) -> Iterator[Any]:
    """Yield the messages of a part, in the order of the file."""
    from mcap.records import Message  # noqa: PLC0415

    file.seek(part.begin)
    for _, end, record in _records(file, None):
        yield from (one for one in _inside(record) if isinstance(one, Message))
        if end >= part.end:
            return


def _records(file: BinaryIO, limit: int | None) -> Iterator[tuple[int, int, Any]]:
    """Yield each record from here on with its position and end, chunks as a whole. limit: of a record's bytes."""
    from mcap.stream_reader import StreamReader  # noqa: PLC0415

    begin = file.tell()
    for record in StreamReader(file, skip_magic=True, emit_chunks=True, record_size_limit=limit).records:
        end = file.tell()
        yield begin, end, record
        begin = end


def _inside(record: Any) -> Iterable[Any]:
    from mcap.records import Chunk  # noqa: PLC0415

    return records_of(record) if isinstance(record, Chunk) else [record]


def _checksum(file: BinaryIO, end: int) -> int:
    """Return the checksum of the file up to `end`."""
    file.seek(0)
    checksum, left = 0, end
    while content := file.read(min(left, _PART_BYTES)):
        checksum, left = zlib.crc32(content, checksum), left - len(content)
    return checksum
