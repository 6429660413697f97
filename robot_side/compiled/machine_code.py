"""Cache of kernels' machine code on disk: one file for each kernel, processor and version of the sources.

An incomplete file counts as absent.
"""

import contextlib
import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from common.files.user_folders import cache_folder

_ENDING: Final = ".machine-code"
_CHECK_BYTES: Final = 32
_VERSIONS: Final = 8
"""Maximum number of files for one kernel, as processors and versions of the sources may alternate"""


def machine_code_folder(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the folder for machine code: $NUMBA_CACHE_DIR, else `kernels` in our folder of the user's cache."""
    given = environment.get("NUMBA_CACHE_DIR")
    return Path(given) if given else cache_folder(environment) / "kernels"


def can_keep() -> bool:
    """Return whether the folder for machine code can be written to or created."""
    folder = machine_code_folder().absolute()
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return os.access(there, os.W_OK | os.X_OK)


def kept(name: str, key: str) -> bytes | None:
    """Return the stored machine code of the kernel `name` for this `key`; None if absent or incomplete."""
    try:
        content = _path(name, key).read_bytes()
    except OSError:
        return None
    # A crash or a full disk may have left an incomplete file.
    check, code = content[:_CHECK_BYTES], content[_CHECK_BYTES:]
    return code if hashlib.sha256(code).digest() == check else None


def keep(name: str, key: str, code: bytes) -> None:
    """Store a kernel's machine code for later starts. If the folder is read-only or the disk full, store nothing."""
    path = _path(name, key)
    # The file is renamed when complete, because other processes may read or write the same file meanwhile.
    part = path.with_suffix(f".{os.getpid()}")
    with contextlib.suppress(OSError):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(hashlib.sha256(code).digest() + code)
            part.replace(path)
        except OSError:
            part.unlink(missing_ok=True)
            raise
        # Partial files of killed processes are deleted with the old ones.
        files = sorted(path.parent.glob(f"{name}-*"), key=lambda file: file.stat().st_mtime)
        for old in files[:-_VERSIONS]:
            old.unlink(missing_ok=True)


def _path(name: str, key: str) -> Path:
    return machine_code_folder() / f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:32]}{_ENDING}"
