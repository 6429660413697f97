"""File of lines that is only added to, each line on the disk before the next step, for one writer at a time."""

import fcntl
import os
from collections.abc import Iterable
from contextlib import ExitStack
from io import FileIO
from pathlib import Path
from typing import Self

from common.errors import ConfigurationError, FeelaheadError


class SyncedLines:
    """The complete lines of a file, and an end to which lines are added.

    Opening changes nothing in the file. A last line that is torn, as by kill -9 or a full disk, is in `torn`; the next
    line that is added replaces it.
    """

    def __init__(self, flag: str, path: Path) -> None:
        """Open or create `path`, and lock it; ConfigurationError, which names `flag`, if the system refuses."""
        self._flag, self._path = flag, path
        if path.exists() and not path.is_file():
            raise ConfigurationError(f"{flag} {path}: this is no regular file; valid: a new file, or one written here")
        self._file = self._locked(path)
        content = self._file.readall()
        self.lines, self.torn = complete_lines(content)
        self._length_bytes = len(content) - len(self.torn)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, line: bytes) -> None:
        """Write one line and wait for the disk; FeelaheadError if that fails, and no earlier line is lost."""
        try:
            self._file.truncate(self._length_bytes)
            _write(self._file, line + b"\n")
        except OSError as error:
            raise FeelaheadError(f"{self._flag} {self._path}: cannot be written: {error.strerror}") from error
        self._length_bytes += len(line) + 1

    def replace(self, lines: Iterable[bytes]) -> None:
        """Let the file have these lines instead, all or none of them; FeelaheadError if that fails."""
        new, content = self._path.with_name(f"{self._path.name}.new"), b"".join(line + b"\n" for line in lines)
        try:
            new.unlink(missing_ok=True)
            with ExitStack() as stack:
                file = stack.enter_context(self._locked(new))
                _write(file, content)
                new.replace(self._path)
                stack.pop_all()
            self._file.close()
            self._file, self._length_bytes = file, len(content)
            sync_folder(self._path.parent)
        except OSError as error:
            raise FeelaheadError(f"{self._flag} {self._path}: cannot be written: {error.strerror}") from error

    def _locked(self, path: Path) -> FileIO:
        try:
            file = FileIO(path, "a+")
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if not os.path.samestat(os.fstat(file.fileno()), path.stat()):
                    raise BlockingIOError  # the other run has just replaced it
                file.seek(0)
            except OSError:
                file.close()
                raise
        except BlockingIOError as error:
            raise ConfigurationError(
                f"{self._flag} {path}: another run writes to it; valid: one run at a time, or another file"
            ) from error
        except OSError as error:
            raise ConfigurationError(f"{self._flag} {path}: cannot be opened and locked: {error.strerror}") from error
        return file


def complete_lines(content: bytes) -> tuple[tuple[bytes, ...], bytes]:
    """Return the lines of a file with their ends, and the last one apart if it is torn; else b""."""
    *lines, torn = content.split(b"\n")
    return tuple(line + b"\n" for line in lines), torn


def sync_folder(folder: Path) -> None:
    """Wait until the names in `folder` are on the disk; OSError if that fails."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _write(file: FileIO, rest: bytes) -> None:
    while rest:
        rest = rest[file.write(rest) :]
    os.fsync(file.fileno())
