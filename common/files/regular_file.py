"""Opening of regular files that a user named. Pipes and devices are refused, because they might never end."""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def regular_file(path: Path) -> Iterator[BinaryIO]:
    """Open the regular file `path` to read its bytes; links are followed.

    Raises OSError if the system refuses, also for a folder; ValueError, in one line without the path, if the file is
    not regular.
    """
    # Windows has no such flags, and no pipes among files.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags)
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(mode):
            raise ValueError("is no regular file; valid: the path of a regular file")
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            yield file
    finally:
        os.close(descriptor)


def read_regular_file(path: Path, largest_bytes: int) -> bytes:
    """Return the content of the regular file `path`.

    Raises as `regular_file`, and ValueError if the file has more than `largest_bytes`.
    """
    with regular_file(path) as file:
        data = file.read(largest_bytes + 1)
    if len(data) > largest_bytes:
        raise ValueError(f"is too large; valid: up to {largest_bytes} bytes")
    return data
