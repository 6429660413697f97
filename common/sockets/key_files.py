"""Files of keys: read and written whole, with every fault named."""

import errno
import os
import re
import stat
from pathlib import Path
from typing import Final, Literal, get_args

from common.errors import ConfigurationError
from common.files.regular_file import read_regular_file

KeyRole = Literal["operator", "observer", "driver", "perception"]
"""What a key may do: drive and watch; watch; be the arm's driver at --arm; send perceived objects to --objects."""
KEY_ROLES: Final[tuple[KeyRole, ...]] = get_args(KeyRole)
_FILE_LIMIT_BYTES = 4096
SHORTAGES = (errno.EMFILE, errno.ENFILE, errno.ENOMEM)
"""Errors that are no fault of the file or folder: this process or the machine lacks descriptors or memory."""
_KEY = re.compile(r"[0-9a-f]{64}")


def is_key(text: str) -> bool:
    """Return whether `text` has the form of a key, in lower case."""
    return _KEY.fullmatch(text) is not None


def checked_key(text: str, what: str) -> str:
    """Return `text` as a key in lower case; raises ConfigurationError, which names `what`."""
    key = text.strip().lower()
    if _KEY.fullmatch(key) is None:
        raise ConfigurationError(f"{what}: {text.strip()[:80]!r} is no key; valid: 64 hexadecimal digits")
    return key


def read_key(path: Path, what: str, *, guarded: bool = True) -> str:
    """Return the key in a file; raises ConfigurationError, which names `what` and the fault.

    guarded: whether nobody else may be able to change the file (`refuse_others`).
    """
    if guarded:
        refuse_others(path)
    lines = _read_lines(path, what)
    if len(lines) != 1:
        raise ConfigurationError(f"{what}: {path} holds {len(lines)} lines; valid: one key of 64 hexadecimal digits")
    return checked_key(lines[0], f"{what}: {path}")


def read_peer(path: Path) -> tuple[str, KeyRole]:
    """Return key and role of an admitted peer; a file without a role is an operator's."""
    try:
        refuse_others(path)
    except OSError as error:
        raise ConfigurationError(f"allowed: {path} cannot be read: {error.strerror}; valid: a file") from error
    lines = _read_lines(path, "allowed")
    role = next((role for role in KEY_ROLES if lines[1:] in ([], [role])), None)
    if not lines or role is None:
        raise ConfigurationError(
            f"allowed: {path} holds {', '.join(map(repr, lines[1:])) or 'nothing'}; valid: one key of 64 hexadecimal "
            f"digits, then a line with its role: {', '.join(KEY_ROLES)}"
        )
    return checked_key(lines[0], f"allowed: {path}"), role


def _read_lines(path: Path, what: str) -> list[str]:
    try:
        content = read_regular_file(path, _FILE_LIMIT_BYTES).decode("ascii")
    except UnicodeDecodeError as error:
        raise ConfigurationError(
            f"{what}: {path} cannot be read: it is no ASCII text; valid: a .public file"
        ) from error
    except OSError as error:
        if error.errno in SHORTAGES:
            raise
        raise ConfigurationError(
            f"{what}: {path} cannot be read: {error.strerror}; valid: a key file that this user may read"
        ) from error
    except ValueError as error:
        raise ConfigurationError(f"{what}: {path} {error}") from error
    return [line.strip() for line in content.splitlines() if line.strip() and not line.startswith("#")]


def stand(path: Path) -> tuple[int, int]:
    """Return a file's time of change and inode; for an unreadable one, -1 and the error's number."""
    try:
        found = path.stat()
    except OSError as error:
        return -1, error.errno or 0
    return found.st_ctime_ns, found.st_ino


def refuse_others(path: Path) -> None:
    """Raise ConfigurationError if other users may change what is read there: the file or folder, or a folder above it.

    Neither the path itself may be a link, nor a file have another name. FileNotFoundError if there is none.
    """
    found = path.lstat()
    if stat.S_ISLNK(found.st_mode):
        raise ConfigurationError(f"{path}: is a link to elsewhere; valid: the file or folder itself")
    if stat.S_ISREG(found.st_mode) and found.st_nlink > 1:
        raise ConfigurationError(f"{path}: has {found.st_nlink} names, so that others may hold it; valid: a copy of it")
    for part in (path, *path.parent.resolve().parents, path.parent.resolve()):
        found = part.lstat()
        mode, ours = stat.S_IMODE(found.st_mode), found.st_uid in (0, os.geteuid())
        # In a folder with the sticky bit, such as /tmp, nobody renames what belongs to another user.
        if mode & 0o022 and not (mode & stat.S_ISVTX and part != path):
            proper = "0700" if stat.S_ISDIR(found.st_mode) else "0600"
            raise ConfigurationError(
                f"{part}: other users may write there (mode {mode:04o}) and so let anyone in; valid: mode {proper}, "
                f"set by `chmod {proper.lstrip('0')} {part}`"
            )
        if not ours:
            raise ConfigurationError(
                f"{part}: belongs to user {found.st_uid}, who may let anyone in; valid: a path of user {os.geteuid()}"
                " or of root"
            )


def write_key_file(path: Path, content: str, mode: int = 0o600) -> None:
    """Write the file atomically, so that a running side never reads half a key."""
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        descriptor = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(content)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise ConfigurationError(f"{path}: cannot be written: {error.strerror}") from error
