"""File with the finished work of a sweep (`--resume FILE.jsonl`), from which a stopped sweep continues."""

import json
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

from common.errors import ConfigurationError
from common.files.synced_lines import SyncedLines
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
        self._file: SyncedLines | None = None
        if path is None:
            return
        with ExitStack() as stack:
            self._file = stack.enter_context(SyncedLines("--resume", path))
            self._load(path, self._file, json.dumps({"made_by": made_by}).encode())
            stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.__exit__()

    def keep(self, key: str, rows: list[Row]) -> None:
        """Add one finished piece to `done` and to the file; FeelaheadError if the file cannot be written."""
        self.done[key] = rows
        if self._file is not None:
            self._file.add(json.dumps({"key": key, "rows": rows}).encode())

    def _load(self, path: Path, file: SyncedLines, first: bytes) -> None:
        if not file.lines and first.startswith(file.torn):
            file.add(first)
            return
        try:
            made_by, asked = json.loads(file.lines[0])["made_by"], json.loads(first)["made_by"]
            other = [name for name, value in asked.items() if made_by.get(name) != value]
            self.done = {entry["key"]: entry["rows"] for entry in map(json.loads, file.lines[1:])}
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            raise ConfigurationError(
                f"--resume {path}: it holds no journal of a sweep; valid: a new file, or one that --resume wrote"
            ) from error
        if other:
            raise ConfigurationError(
                f"--resume {path}: it was written by another {' and '.join(other)}; valid: a new file"
            )
