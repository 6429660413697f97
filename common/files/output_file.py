"""Output files that a user named: checked at the start, and written completely or not at all."""

import json
import os
import secrets
import stat
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from common.errors import ConfigurationError


def require_output_file(flag: str, path: Path | None, endings: Sequence[str] = ()) -> None:
    """Raise ValueError if `path` cannot be written or its folder does not exist; None is valid.

    `endings`: valid endings of the file's name in lower case; empty: all are valid.
    """
    if path is None:
        return
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise ValueError(
            f"{flag} {path}: is a folder, or lies in a folder that does not exist; valid: a file in an existing folder"
        )
    end = os.path.realpath(path)
    # `realpath` of links in a circle is one of them.
    if os.path.lexists(end) and not os.access(end, os.W_OK):
        raise ValueError(f"{flag} {path}: this user may not write to it; valid: a file that this user may write")
    if endings and path.suffix.lower() not in endings:
        raise ValueError(
            f"{flag} {path}: its ending is unknown; valid: a file's path that ends in {', '.join(endings)}"
        )


def require_folder(flag: str, path: Path) -> None:
    """Raise ConfigurationError if this user cannot make the missing folders of `path`, or write into its folder."""
    first = next(folder for folder in path.absolute().parents if os.path.lexists(folder))
    if not (first.is_dir() and os.access(first, os.W_OK | os.X_OK)):
        raise ConfigurationError(f"{flag} {path}: {first} is no folder that this user may write to; valid: one that is")


@contextmanager
def output_file(flag: str, path: Path) -> Iterator[TextIO]:
    """Open `path` to write text, with line ends unchanged. The old content stays until the new text is complete.

    For that a new file replaces the old one. But a pipe, a file with a second name, or another user's file is written
    in place, because others would notice the replacement. Raises ConfigurationError, in one line that names `flag`, if
    the system refuses, as on a full disk.
    """
    end = Path(os.path.realpath(path))  # a link stays a link
    new = end.with_name(f".feelahead-{secrets.token_hex(8)}")
    replaced = False
    try:
        old = _state(path)
        own = _own_output(old)
        replaced = own is None and _replaceable(path, end, old)
        place = new if replaced else path if own is None else own
        with open(place, "w", newline="", encoding="utf-8", closefd=own is None) as file:
            if replaced and old is not None:
                os.fchmod(file.fileno(), stat.S_IMODE(old.st_mode))
            yield file
        if replaced:
            new.replace(end)
    except OSError as error:
        reason = f"{error.strerror}; valid: a folder that this user may write to, with enough room"
        raise ConfigurationError(f"{flag} {path}: cannot be written: {reason}") from error
    finally:
        if replaced:
            new.unlink(missing_ok=True)


def _state(path: Path) -> os.stat_result | None:
    """Return the `stat` of the file; None if there is no file."""
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _own_output(old: os.stat_result | None) -> int | None:
    """Return the descriptor of our standard output or error if it is the file `old`, else None.

    Writing to that descriptor continues at the stream's position.
    """
    for descriptor, stream in ((1, sys.stdout), (2, sys.stderr)):
        if old is not None and stream is not None and os.path.samestat(old, os.fstat(descriptor)):
            stream.flush()
            return descriptor
    return None


def _replaceable(path: Path, end: Path, old: os.stat_result | None) -> bool:
    """Return whether a new file may replace the old one unnoticed: no pipe, no other owner, no second name."""
    if old is None:
        return os.access(end.parent, os.W_OK)
    plain = stat.S_ISREG(old.st_mode) and path.absolute().parts[1] not in ("dev", "proc")
    ours = (old.st_uid, old.st_gid, old.st_nlink) == (os.geteuid(), os.getegid(), 1)
    return plain and ours and os.access(end, os.W_OK) and os.access(end.parent, os.W_OK)


def write_json(flag: str, path: Path, figures: Any) -> None:
    """Write `figures` as JSON; errors as in `output_file`."""
    with output_file(flag, path) as file:
        file.write(json.dumps(figures, indent=2) + "\n")
