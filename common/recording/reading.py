"""Reading of recordings, even if the file was cut off: up to the last complete chunk (a second).

The file is read record by record, because its index is at the end, which a file that was cut off lacks.
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
    """Message of a recording's file."""

    topic: str
    log_ns: int
    """Nanoseconds on the wall clock"""
    content: bytes


@dataclass(frozen=True)
class Recording:
    """Recording, with what a scan of its file found."""

    path: Path
    headers: Mapping[str, Mapping[str, Any]]
    """Settings, versions and other values of each recorded core, keyed by side"""
    whole: bool
    """Whether the file was finished; if not, it is read up to the last complete chunk"""
    damaged: bool = False
    """Whether a chunk is damaged; the file is then read up to that chunk"""
    end_ns: int = 0
    """Newest stamp in the intact chunks, in nanoseconds on the wall clock"""

    def began_ns(self) -> int:
        """Return the stamp of the first message, in nanoseconds on the wall clock; 0 without messages."""
        return next((message.log_ns for message in self.messages()), 0)

    def length_s(self) -> float:
        """Return the time from the first message to the last one that can be read, in seconds."""
        return 1e-9 * (self.end_ns - self.began_ns()) if self.end_ns else 0.0

    def messages(self, topics: Collection[str] = ()) -> Iterator[Message]:
        """Yield the messages of `topics`, or all if none is given, in the order of the file, nearly that of time."""
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
    """Scan the file at `path`; raises ConfigurationError, in one line, if it is no recording of ours."""
    require_packages("a recording", "mcap")
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
        raise ConfigurationError(f"{path}: its header is damaged; valid: an undamaged file that --record made")
    if not headers:
        raise ConfigurationError(
            f"{path}: holds nothing that feelahead recorded; valid: a file that --record made in a second or longer"
        )
    return Recording(path, headers, whole, damaged, end_ns)


def _header(path: Path, values: Mapping[str, str]) -> dict[str, Any]:
    if values.get("format") != str(FORMAT):
        raise ConfigurationError(
            f"{path}: has the format {values.get('format')} of recordings; valid: format {FORMAT}, of this version"
        )
    return {name: _value(text) for name, text in values.items()}


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def _records(path: Path) -> Iterator[tuple[Any, list[Any]]]:
    """Yield each complete record, with its records if it is a chunk. At a damaged one, yield None and end."""
    from mcap.exceptions import EndOfFile, InvalidMagic, RecordLengthLimitExceeded  # noqa: PLC0415
    from mcap.records import Chunk, DataEnd  # noqa: PLC0415
    from mcap.stream_reader import StreamReader, breakup_chunk  # noqa: PLC0415

    try:
        if path.is_fifo():
            raise ConfigurationError(f"{path}: cannot be read: it is a pipe; valid: a file that --record made")
        with path.open("rb") as file:
            for record in StreamReader(file, emit_chunks=True, record_size_limit=path.stat().st_size).records:
                yield record, breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else []
                if isinstance(record, DataEnd):
                    return  # the rest repeats
    except OSError as error:
        raise ConfigurationError(
            f"{path}: cannot be read: {error.strerror}; valid: a file that --record made"
        ) from error
    except InvalidMagic as error:
        raise ConfigurationError(f"{path}: is no MCAP file; valid: a file that --record made") from error
    except (EndOfFile, RecordLengthLimitExceeded):
        return  # cut off while being written
    except ConfigurationError:
        raise
    # Readers and decompressors report flipped bits by various classes.
    except Exception:
        yield None, []
