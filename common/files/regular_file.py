"""Reading of regular files that a user named. Pipes and devices are refused, because they might never end."""

import errno
import os
import stat
from pathlib import Path


def read_regular_file(path: Path, largest_bytes: int) -> bytes:
    """Return the content of the regular file `path`; links are followed.

    Raises OSError if the system refuses, also for a folder; ValueError, in one line without the path, if the file is
    not regular or has more than `largest_bytes`.
    """
    # Windows has no such flags, and no pipes among files.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags)
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(mode):
            raise ValueError("is no regular file; valid: a file's path")
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            data = file.read(largest_bytes + 1)
    finally:
        os.close(descriptor)
    if len(data) > largest_bytes:
        raise ValueError(f"has more than {largest_bytes} bytes")
    return data
