"""What long work has done so far, kept in a file, so that it can be stopped and gone on with."""

import contextlib
import fcntl
import hashlib
import json
from pathlib import Path
from typing import Any, Final, TextIO

from common.errors import ConfigurationError, FeelaheadError
from feelahead.lab.approaches.frozen import frozen_hash

Records = list[dict[str, Any]]
_ROOT: Final = Path(__file__).parents[3]
_CODE: Final = ("common", "operator_side", "robot_side", "feelahead")


class Kept:
    """A file with a line for each piece that is done; of another set-up, or of other code, nothing of it counts."""

    def __init__(self, path: Path | None, setup: dict[str, Any]) -> None:
        """ConfigurationError for a file that is there and holds another run, or none, or that another run writes to."""
        self._file: TextIO | None = None
        self._setup: dict[str, Any] = json.loads(json.dumps(setup | {"frozen": frozen_hash(), "code": code_hash()}))
        self.done: dict[str, Records] = {}
        if path is None:
            return
        if path.exists() and not path.is_file():
            raise ConfigurationError(f"--resume {path}: is no regular file; valid: a file of its own, or a new one")
        self._file = path.open("a+", encoding="utf-8")
        try:
            self._load(path, self._file)
        except FeelaheadError:
            self.close()
            raise

    def _load(self, path: Path, file: TextIO) -> None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            file.seek(0)
            text = file.read()
        except BlockingIOError as error:
            raise ConfigurationError(f"--resume {path}: another run writes to it; valid: a file of its own") from error
        except OSError as error:
            raise ConfigurationError(
                f"--resume {path}: cannot be locked and read: {error.strerror}; valid: a file on another disk"
            ) from error
        except UnicodeDecodeError as error:
            raise ConfigurationError(
                f"--resume {path}: it holds no run of this benchmark; valid: a new file"
            ) from error
        entries = [entry for line in text.splitlines() if isinstance(entry := _read(line), dict)]
        if text and (not entries or "code" not in entries[0]):
            raise ConfigurationError(f"--resume {path}: it holds no run of this benchmark; valid: a new file")
        if entries and entries[0] != self._setup:
            raise ConfigurationError(f"--resume {path}: it holds a run with other settings or code; valid: a new file")
        if not text:
            self._write(json.dumps(self._setup))
        elif not text.endswith("\n"):
            self._write("")
        # A line may be torn: whoever wrote it was stopped.
        self.done = {entry["piece"]: entry["records"] for entry in entries if {"piece", "records"} <= entry.keys()}

    def keep(self, piece: str, records: Records) -> None:
        """Write one piece down at once; one that failed is tried again next time."""
        self.done[piece] = records
        if not any(record.get("kind") == "failed" for record in records):
            self._write(json.dumps({"piece": piece, "records": records}))

    def close(self) -> None:
        """Let others write to the file."""
        if self._file is not None:
            # What could not be written was said already.
            with contextlib.suppress(OSError):
                self._file.close()

    def _write(self, line: str) -> None:
        if self._file is not None:
            try:
                self._file.write(line + "\n")
                self._file.flush()
            except OSError as error:
                raise FeelaheadError(f"--resume {self._file.name}: cannot be written: {error.strerror}") from error


def code_hash() -> str:
    """One hash of the code that the figures come from."""
    digest = hashlib.sha256()
    for folder in _CODE:
        for path in sorted((_ROOT / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _read(line: str) -> Any:
    try:
        return json.loads(line)
    except json.JSONDecodeError:
        return None
