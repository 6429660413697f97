"""Whether a file that a person named can be read, asked before anything starts."""

from pathlib import Path


def require_input_file(flag: str, path: Path, valid: str) -> None:
    """ValueError unless `path` leads to a file: it says what is there instead, and what would be `valid`."""
    if path.is_dir():
        raise ValueError(f"{flag} {path}: is a directory; valid: {valid}")
    if not path.is_file():
        raise ValueError(f"{flag} {path}: there is no such file; valid: {valid}")
