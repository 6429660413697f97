"""File with the finished work of a sweep (`--resume FILE.jsonl`), from which a stopped sweep continues."""

import fcntl
import json
import os
from collections.abc import Mapping
from contextlib import ExitStack
from io import FileIO
from pathlib import Path
from typing import Any, Self

from common.errors import ConfigurationError, FeelaheadError
from feelahead.lab.table import Row


class Journal:
    """File whose first line identifies the question and its code; each further line has one finished piece of work.

    Each piece is written and synced to the disk before the next one. If kill -9 has left an incomplete last line, the
    line is removed and its piece is run again, so that no row is lost or doubled.
    """

    def __init__(self, path: Path | None, made_by: Mapping[str, Any]) -> None:
        """Open or create the file; `path` None: keep the work in memory only.

        ConfigurationError if the file is of another question or code than `made_by`, or if another run writes to it.
        """
        self.done: dict[str, list[Row]] = {}
        self._file: FileIO | None = None
        if path is None:
            return
        if path.exists() and not path.is_file():
            raise ConfigurationError(
                f"--resume {path}: not a regular file; valid: a new file, or one that --resume wrote"
            )
        try:
            with ExitStack() as stack:
                self._file = stack.enter_context(FileIO(path, "a+"))
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                self._load(path, self._file, json.dumps({"made_by": made_by}).encode())
                stack.pop_all()
        except BlockingIOError as error:
            raise ConfigurationError(f"--resume {path}: another run writes to it; valid: another file") from error
        except OSError as error:
            raise ConfigurationError(f"--resume {path}: cannot be opened and locked: {error.strerror}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def keep(self, key: str, rows: list[Row]) -> None:
        """Add one finished piece to `done` and to the file; FeelaheadError if the file cannot be written."""
        self.done[key] = rows
        self._write(json.dumps({"key": key, "rows": rows}).encode())

    def _load(self, path: Path, file: FileIO, first: bytes) -> None:
        file.seek(0)
        text = file.readall()
        lines = text.splitlines(keepends=True)
        torn = lines.pop() if lines and not lines[-1].endswith(b"\n") else b""
        if not lines and first.startswith(torn):
            file.truncate(0)
            self._write(first)
            return
        try:
            made_by, asked = json.loads(lines[0])["made_by"], json.loads(first)["made_by"]
            other = [name for name, value in asked.items() if made_by.get(name) != value]
            self.done = {entry["key"]: entry["rows"] for entry in map(json.loads, lines[1:])}
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            raise ConfigurationError(f"--resume {path}: it holds no journal of a sweep; valid: a new file") from error
        if other:
            raise ConfigurationError(f"--resume {path}: made by another {' and '.join(other)}; valid: a new file")
        file.truncate(len(text) - len(torn))

    def _write(self, line: bytes) -> None:
        if self._file is None:
            return
        try:
            rest = line + b"\n"
            while rest:
                rest = rest[self._file.write(rest) :]
            os.fsync(self._file.fileno())
        except OSError as error:
            raise FeelaheadError(f"--resume {self._file.name}: cannot be written: {error.strerror}") from error
