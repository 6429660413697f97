"""Folder of a study: copy of the protocol, journal, and a recording for each trial."""

import os
import shutil
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final, NamedTuple, Self

from common.errors import ConfigurationError, FeelaheadError
from common.files.output_file import require_folder
from common.files.synced_lines import sync_folder
from feelahead.study.events import Begun, Ended, Enrolled, Event, Withdrew
from feelahead.study.journal import StudyJournal, read_events
from feelahead.study.progress import require_next, step_after
from feelahead.study.protocol import Protocol, load_protocol
from feelahead.study.records import recording_name
from feelahead.study.steps import Step

PROTOCOL: Final = "protocol.toml"
JOURNAL: Final = "journal.jsonl"
TRIALS: Final = "trials"
UNFINISHED: Final = "unfinished-"
"""Begin of a recording's name until it is whole"""
MADE_ANEW: Final = ("trials.parquet", "answers.parquet", "contrasts.parquet", "cells.parquet", "report.html")
"""Files that a report makes from the others"""


class StudyData(NamedTuple):
    """What a folder holds, read while another run may write to it."""

    protocol: Protocol
    events: tuple[Event, ...]


def read_study(folder: Path) -> StudyData:
    """Read protocol and journal; ConfigurationError for a folder that is none of a study, or damaged."""
    if not (folder / PROTOCOL).is_file():
        raise ConfigurationError(f"{folder}: holds no {PROTOCOL}; valid: a folder that feelahead study made")
    protocol = load_protocol(folder / PROTOCOL)
    return StudyData(protocol, read_events(folder / JOURNAL, protocol))


class Study:
    """A study's folder, opened by the one run that writes to it.

    Whatever ends that run, at any moment: the next one goes on where it ended, and does no complete trial twice.
    """

    def __init__(self, folder: Path, protocol: Path) -> None:
        """Open a study, or begin it in a new or empty folder.

        ConfigurationError if the folder is of another protocol, is in use, or cannot be written.
        """
        self.folder, self.protocol = folder, load_protocol(protocol)
        self._unremoved: set[int] = set()
        self._prepare(protocol)
        with ExitStack() as stack:
            self.journal = stack.enter_context(StudyJournal(folder / JOURNAL, self.protocol))
            sync_folder(folder)
            for participant in self.journal.participants:
                self._recover(participant)
            stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.journal.__exit__()

    def require_all(self, *, simulated: bool) -> None:
        """Raise ConfigurationError if people and simulated persons would share the folder."""
        for event in self.journal.events:
            if isinstance(event, Enrolled) and event.simulated != simulated:
                found, valid = ("a person", "people") if simulated else ("simulated", "simulated persons")
                raise ConfigurationError(
                    f"{self.folder}: participant {event.participant} is {found}; valid: a new folder, or only {valid}"
                )

    def next_step(self, participant: int) -> Step:
        """Return what comes next for a participant."""
        return step_after(self.protocol, self.journal.progress(participant), participant)

    def add(self, event: Event) -> None:
        """Take an event, once it is on the disk.

        ValueError if it may not come now; FeelaheadError if it cannot be written. Nothing has happened then. But data
        of a withdrawal that cannot be removed yet are removed with a later event, or at the next start.
        """
        progress = self.journal.progress(event.participant)
        require_next(self.protocol, progress, event)
        if isinstance(event, Begun) and (whole := self._whole(event)).exists():
            raise FeelaheadError(f"{whole}: is there before its trial; valid: a folder with its own recordings alone")
        if isinstance(event, Ended):
            self._keep(progress.attempts[-1].begun)
        self.journal.add(event)
        for participant in tuple(self._unremoved):
            with suppress(FeelaheadError):
                self._remove(participant)
        if isinstance(event, Withdrew) and self.protocol.withdrawn == "remove":
            self._remove(event.participant)

    def recording(self, begun: Begun) -> Path:
        """Return the file into which an attempt is to be recorded; it gets its own name when the attempt has ended."""
        return self._whole(begun).with_name(f"{UNFINISHED}{self._whole(begun).name}")

    def _whole(self, begun: Begun) -> Path:
        return self.folder / TRIALS / recording_name(begun)

    def _keep(self, begun: Begun) -> None:
        recorded, whole = self.recording(begun), self._whole(begun)
        try:
            if whole.exists() and not recorded.exists():
                return  # the event could not be written the time before
            _sync(recorded)
            recorded.replace(whole)
            sync_folder(whole.parent)
        except OSError as error:
            raise FeelaheadError(f"{whole}: cannot be kept: {error.strerror}") from error

    def _recover(self, participant: int) -> None:
        """Finish what the run before had begun to write down: an end, or a removal."""
        progress = self.journal.progress(participant)
        if progress.withdrawn and self.protocol.withdrawn == "remove":
            self._remove(participant)
        elif progress.open is not None:
            begun = progress.open.begun
            whole = self._whole(begun)
            if whole.is_file():
                ended = Ended(
                    participant=participant,
                    at_s=begun.at_s,  # nobody has seen when
                    trial=begun.trial,
                    attempt=begun.attempt,
                    practice=begun.practice,
                )
                self.journal.add(ended)

    def _remove(self, participant: int) -> None:
        self._unremoved.add(participant)
        try:
            for path in (self.folder / TRIALS).glob(f"*p{participant:02d}-*.mcap"):
                path.unlink()
            for name in MADE_ANEW:
                (self.folder / name).unlink(missing_ok=True)
            sync_folder(self.folder / TRIALS)
        except OSError as error:
            raise FeelaheadError(f"participant {participant}: data cannot be removed: {error.strerror}") from error
        self.journal.remove(participant)
        self._unremoved.remove(participant)

    def _prepare(self, protocol: Path) -> None:
        own = self.folder / PROTOCOL
        if own.exists():
            if load_protocol(own).hash != self.protocol.hash:
                raise ConfigurationError(
                    f"{self.folder}: was begun with another protocol than {protocol}; valid: {own}, or a new folder"
                )
        else:
            self._begin(protocol, own)

    def _begin(self, protocol: Path, own: Path) -> None:
        new = own.with_suffix(".new")
        if self.folder.exists() and not {path.name for path in self.folder.iterdir()} <= {new.name, TRIALS}:
            raise ConfigurationError(f"{self.folder}: has other files; valid: a new or empty folder, or a study's")
        require_folder("--out", self.folder / PROTOCOL)
        try:
            (self.folder / TRIALS).mkdir(parents=True, exist_ok=True)
            shutil.copyfile(protocol, new)
            _sync(new)
            new.replace(own)
            for folder in (self.folder, self.folder.absolute().parent):
                sync_folder(folder)
        except OSError as error:
            raise ConfigurationError(f"--out {self.folder}: cannot be written: {error.strerror}") from error


def _sync(path: Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())
