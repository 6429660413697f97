"""Whether a file that a person named can be written, asked before hours of work rather than after."""

from collections.abc import Sequence
from pathlib import Path


def require_output_file(flag: str, path: Path | None, endings: Sequence[str] = ()) -> None:
    """ValueError unless `path` is None, or a file's path in a folder that is there, with one of `endings` if given."""
    if path is None:
        return
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise ValueError(f"{flag} {path}: is a folder, or its folder is not there; valid: a file's path")
    if endings and path.suffix.lower() not in endings:
        raise ValueError(f"{flag} {path}: valid: a file's path that ends in {', '.join(endings)}")
