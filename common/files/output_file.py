"""Files that a person wants written: whether they can be is asked at the start, and they are written whole or not."""

import json
import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from common.errors import ConfigurationError


def require_output_file(flag: str, path: Path | None, endings: Sequence[str] = ()) -> None:
    """ValueError unless `path` is None, or a file's path in a folder that is there, with one of `endings` if given."""
    if path is None:
        return
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise ValueError(f"{flag} {path}: is a folder, or its folder is not there; valid: a file's path")
    if endings and path.suffix.lower() not in endings:
        raise ValueError(f"{flag} {path}: valid: a file's path that ends in {', '.join(endings)}")


@contextmanager
def output_file(flag: str, path: Path) -> Iterator[TextIO]:
    """`path`, open for text, lines as they are given; what was there before stays until all of the new is written.

    ConfigurationError, in one line of `flag`, when the system does not let us write it, as on a full disk.
    """
    end = path.resolve()  # a link stays a link
    # A pipe or a device cannot be replaced, and a file in a folder that is not ours may not be.
    replaced = (path.is_file() or not path.exists()) and os.access(end.parent, os.W_OK)
    written = end.with_name(f".feelahead-{secrets.token_hex(8)}") if replaced else path
    try:
        with written.open("x" if replaced else "w", newline="", encoding="utf-8") as file:
            yield file
        if replaced:
            written.replace(end)
    except OSError as error:
        reason = f"{error.strerror}; valid: a place that can be written to, with room for it"
        raise ConfigurationError(f"{flag} {path}: cannot be written: {reason}") from error
    finally:
        if replaced:
            written.unlink(missing_ok=True)


def write_json(flag: str, path: Path, figures: Any) -> None:
    """`figures` for programs; errors as in `output_file`."""
    with output_file(flag, path) as file:
        file.write(json.dumps(figures, indent=2) + "\n")
