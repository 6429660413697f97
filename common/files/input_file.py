"""Check, at the start, of an input file that a user named."""

from pathlib import Path


def require_input_file(flag: str, path: Path, valid: str) -> None:
    """Raise ValueError unless `path` leads to a file; the text names `flag`, the fault and what is `valid`."""
    if path.is_dir():
        raise ValueError(f"{flag} {path}: is a directory; valid: {valid}")
    if not path.is_file():
        raise ValueError(f"{flag} {path}: there is no such file; valid: {valid}")
