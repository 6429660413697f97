"""Journal of a study: its events, each on the disk before the next step."""

import json
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Self

import msgspec

from common.errors import ConfigurationError
from common.files.synced_lines import SyncedLines, complete_lines
from feelahead.study.events import Enrolled, Event, Withdrew
from feelahead.study.progress import Progress
from feelahead.study.protocol import Protocol


class StudyJournal:
    """File whose first line names the protocol, and each further line is an event. One run at a time writes to it."""

    def __init__(self, path: Path, protocol: Protocol) -> None:
        """Open or create the file; ConfigurationError if it is of another protocol, damaged, or in use."""
        self._first = _first_line(protocol)
        self._events: list[Event] = []
        self._progress: dict[int, Progress] = {}
        with ExitStack() as stack:
            self._file = stack.enter_context(SyncedLines("journal", path))
            if not self._file.lines and self._first.startswith(self._file.torn):
                self._file.add(self._first)
            else:
                self._remember(read_events(path, protocol))
            stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.__exit__()

    @property
    def participants(self) -> tuple[int, ...]:
        """Numbers of all who have an event, in order"""
        return tuple(sorted(self._progress))

    @property
    def events(self) -> tuple[Event, ...]:
        """All events in their order"""
        return tuple(self._events)

    def progress(self, participant: int) -> Progress:
        """Return the state of a participant after all events."""
        return self._progress.get(participant, Progress())

    def add(self, event: Event) -> None:
        """Write an event and wait for the disk; FeelaheadError if that fails: then it has not happened."""
        self._file.add(msgspec.json.encode(event))
        self._remember([event])

    def remove(self, participant: int) -> None:
        """Let nothing of a participant stay but the number, and that somebody withdrew; errors as of `add`."""
        kept: list[Event] = []
        for event in self._events:
            if event.participant != participant or isinstance(event, Enrolled):
                kept.append(event)
            elif isinstance(event, Withdrew):
                kept.append(msgspec.structs.replace(event, reason=""))  # it may tell who it was
        self._file.replace([self._first, *map(msgspec.json.encode, kept)])
        self._events, self._progress = [], {}
        self._remember(kept)

    def _remember(self, events: Iterable[Event]) -> None:
        for event in events:
            self._events.append(event)
            self._progress[event.participant] = self.progress(event.participant).after(event)


def read_events(path: Path, protocol: Protocol) -> tuple[Event, ...]:
    """Return the events in a journal, also while another run writes to it; a torn last line is left out.

    ConfigurationError names what is wrong and where.
    """
    try:
        lines, _ = complete_lines(path.read_bytes())
    except OSError as error:
        raise ConfigurationError(f"journal {path}: cannot be read: {error.strerror}") from error
    if not lines or lines[0].rstrip() != _first_line(protocol):
        raise ConfigurationError(f"journal {path}: is of another protocol, or none; valid: that of {protocol.hash}")
    found: list[Event] = []
    for number, line in enumerate(lines[1:], 2):
        try:
            found.append(msgspec.json.decode(line, type=Event))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise ConfigurationError(f"journal {path}: line {number} is damaged: {error}; valid: an event") from error
    return tuple(found)


def _first_line(protocol: Protocol) -> bytes:
    return json.dumps({"study": protocol.name, "protocol": protocol.hash}).encode()
