"""Recordings read, whole or cut off anywhere: up to the last complete second.

The file is gone through record by record, as an index stands at the end, where a cut file has none.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from common.errors import ConfigurationError
from common.recording.packages import require_packages
from common.recording.wire import FORMAT, PROFILE

_SIDES: Final = {f"{PROFILE}.{side}": side for side in ("robot", "operator")}


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
        for record, inside in _records(self.path):
            if record is None:
                return
            for one in inside:
                if isinstance(one, Channel):
                    names[one.id] = one.topic
                elif isinstance(one, Logged):
                    topic = names.get(one.channel_id, "")
                    if not topics or topic in topics:
                        yield Message(topic, one.log_time, one.data)


def open_recording(path: Path) -> Recording:
    """Look through the file at `path`; ConfigurationError, in one line, for what is no recording of ours."""
    require_packages("a recording", "foxglove", "mcap")
    from mcap.records import Chunk, DataEnd, Metadata  # noqa: PLC0415

    headers: dict[str, Mapping[str, Any]] = {}
    whole, damaged, end_ns = False, False, 0
    for record, _ in _records(path):
        damaged |= record is None
        if isinstance(record, Metadata) and record.name in _SIDES:
            headers[_SIDES[record.name]] = _header(path, record.metadata)
        elif isinstance(record, Chunk):
            end_ns = max(end_ns, record.message_end_time)
        whole |= isinstance(record, DataEnd)
    if not headers and damaged:
        raise ConfigurationError(f"{path}: what it says of itself is damaged; valid: a file as --record made it")
    if not headers:
        raise ConfigurationError(
            f"{path}: holds nothing that feelahead recorded; valid: a file that --record made, of a second or more"
        )
    return Recording(path, headers, whole, damaged, end_ns)


def _header(path: Path, values: Mapping[str, str]) -> dict[str, Any]:
    if values.get("format") != str(FORMAT):
        raise ConfigurationError(f"{path}: recorded in format {values.get('format')}; valid: {FORMAT}")
    return {name: _value(text) for name, text in values.items()}


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def _records(path: Path) -> Iterator[tuple[Any, list[Any]]]:
    """Each whole record with what a chunk has inside; last a None where one is not as it was written."""
    from mcap.exceptions import EndOfFile, InvalidMagic, RecordLengthLimitExceeded  # noqa: PLC0415
    from mcap.records import Chunk, DataEnd  # noqa: PLC0415
    from mcap.stream_reader import StreamReader, breakup_chunk  # noqa: PLC0415

    try:
        if path.is_fifo():
            raise ConfigurationError(f"{path}: cannot be read: it is a pipe; valid: a recording's file")
        with path.open("rb") as file:
            for record in StreamReader(file, emit_chunks=True, record_size_limit=path.stat().st_size).records:
                yield record, breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else []
                if isinstance(record, DataEnd):
                    return  # what follows repeats
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror}; valid: a recording") from error
    except InvalidMagic as error:
        raise ConfigurationError(f"{path}: is no MCAP file; valid: a file that --record made") from error
    except (EndOfFile, RecordLengthLimitExceeded):
        return  # it was being written
    except ConfigurationError:
        raise
    # What a flipped bit does is said by readers and decompressors in classes of their own.
    except Exception:
        yield None, []
