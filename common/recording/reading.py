"""Reading of recordings in any legal form of MCAP, even if the file was cut off: up to the last complete chunk.

A recording that another tool wrote again, in another form or order, gives the same messages in the same order.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count
from pathlib import Path
from typing import Any, Final, NamedTuple

from common.errors import ConfigurationError
from common.extras import require_packages
from common.recording.mcap_scan import Part, Scan, messages_in
from common.recording.topics import OURS
from common.recording.wire import FORMAT, PROFILE

_SIDES: Final = {f"{PROFILE}.{side}": side for side in ("robot", "operator")}
_HOUR_NS: Final = 3_600_000_000_000
_LONGEST_NS: Final = 24 * _HOUR_NS
_MOST_WAITING_BYTES: Final = 1 << 30
"""Most bytes of messages that are kept until older ones, which stand later in the file, have come"""


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
    damaged: bool
    """Whether a chunk is damaged; the file is then read up to that chunk"""
    topics: Collection[str]
    """Topics with messages"""
    began_ns: int
    """Oldest stamp of our own topics, in nanoseconds on the wall clock"""
    end_ns: int
    """Newest stamp of our own topics"""
    _parts: tuple[Part, ...]
    """Parts of the file by their oldest stamps"""
    _names: Mapping[int, str]

    def length_s(self) -> float:
        """Return the time from the first message to the last one that can be read, in seconds."""
        return 1e-9 * (self.end_ns - self.began_ns)

    def require(self, topics: Collection[str]) -> None:
        """Raise ConfigurationError if there are no messages of any of `topics`."""
        if not any(topic in self.topics for topic in topics):
            here, valid = (", ".join(sorted(names)) for names in (self.topics, topics))
            raise ConfigurationError(f"{self.path}: has only messages of {here}; valid: with one at least of {valid}")

    def messages(self, topics: Collection[str] = ()) -> Iterator[Message]:
        """Yield the messages of `topics`, or all if none is given, in order of time.

        At equal times they come in the order of their topics' names, and within a topic as they were written.
        """
        waiting: list[tuple[int, str, int, int, bytes]] = []
        number, held = count(), 0
        with self.path.open("rb") as file:
            for part in self._parts:
                while waiting and waiting[0][0] < part.start_ns:
                    held -= len(waiting[0][-1])
                    yield _first(waiting)
                for one in messages_in(file, part):
                    topic = self._names[one.channel_id]
                    if not topics or topic in topics:
                        heappush(waiting, (one.log_time, topic, one.sequence, next(number), one.data))
                        held += len(one.data)
                        if held > _MOST_WAITING_BYTES:
                            raise ConfigurationError(
                                f"{self.path}: has more than {_MOST_WAITING_BYTES} bytes of messages out of order;"
                                " valid: a file in order of time (mcap sort)"
                            )
        while waiting:
            yield _first(waiting)


def _first(waiting: list[tuple[int, str, int, int, bytes]]) -> Message:
    log_ns, topic, _, _, content = heappop(waiting)
    return Message(topic, log_ns, content)


def open_recording(path: Path) -> Recording:
    """Scan the file at `path`; raises ConfigurationError, in one line, if it is no recording of ours."""
    require_packages("a recording", "mcap")
    scan = Scan(path)
    try:
        if path.is_fifo():
            raise ConfigurationError(f"{path}: cannot be read: it is a pipe; valid: a file that --record made")
        with path.open("rb") as file:
            scan.read(file)
    except OSError as error:
        raise ConfigurationError(
            f"{path}: cannot be read: {error.strerror}; valid: a file that --record made"
        ) from error
    headers = _headers(scan)
    if not scan.parts:
        why = "holds no messages" if scan.whole else "ends before its first complete second"
        why = "is damaged in its first second" if scan.damaged else why
        raise ConfigurationError(f"{path}: {why}; valid: a file that --record made in a second or longer")
    # Another tool's messages in the file may have another clock.
    stamps_ns = [of_topic for topic, of_topic in scan.stamps_ns.items() if topic in OURS] or [*scan.stamps_ns.values()]
    began_ns, end_ns = min(first for first, _ in stamps_ns), max(last for _, last in stamps_ns)
    if end_ns - began_ns > _LONGEST_NS:
        hours, most = (end_ns - began_ns) / _HOUR_NS, _LONGEST_NS // _HOUR_NS
        raise ConfigurationError(f"{path}: spans {hours:.0f} h by its stamps; valid: at most {most} h, by one clock")
    parts = tuple(sorted(scan.parts))
    topics = scan.stamps_ns.keys()
    return Recording(path, headers, scan.whole, scan.damaged, topics, began_ns, end_ns, parts, scan.names)


def _headers(scan: Scan) -> dict[str, Mapping[str, Any]]:
    found: dict[str, Mapping[str, Any]] = {}
    for name, values in scan.metadata:
        if name in _SIDES:
            header = _header(scan.path, values)
            if found.setdefault(_SIDES[name], header) != header:
                raise ConfigurationError(f"{scan.path}: holds two runs of the {_SIDES[name]} side; valid: one")
    if found:
        return found
    why, valid = "holds nothing that feelahead recorded", "a file that --record made in a second or longer"
    if scan.damaged:
        why, valid = "its header is damaged", "an undamaged file that --record made"
    elif not OURS.isdisjoint(scan.stamps_ns):
        why = f"lacks the metadata {' and '.join(_SIDES)}, which another tool has left out"
        valid = "with one at least (mcap filter --include-metadata)"
    raise ConfigurationError(f"{scan.path}: {why}; valid: {valid}")


def _header(path: Path, values: Mapping[str, str]) -> dict[str, Any]:
    if values.get("format") != str(FORMAT):
        raise ConfigurationError(
            f"{path}: has the format {values.get('format')} of recordings; valid: format {FORMAT}, of this version"
        )
    return {name: _value(text) for name, text in values.items()}


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # also numbers of thousands of digits, and thousands of brackets
        return text
