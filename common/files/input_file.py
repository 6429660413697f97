"""Check of a file that a person named, before anything starts."""

from pathlib import Path


def require_input_file(flag: str, path: Path, valid: str) -> None:
    """Raise ValueError, which names the fault and what is `valid`, unless `path` leads to a file."""
    if path.is_dir():
        raise ValueError(f"{flag} {path}: is a directory; valid: {valid}")
    if not path.is_file():
        raise ValueError(f"{flag} {path}: there is no such file; valid: {valid}")
