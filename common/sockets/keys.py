"""Keys as text files: this side's own pair, and the public keys of the peers that it admits.

    FOLDER/robot.secret        the robot side's secret key (mode 0600)
    FOLDER/robot.public        its public part, to be given to the operators
    FOLDER/allowed/NAME.public the public key of an admitted peer; deleting the file revokes it

A key is 64 hexadecimal digits (32 bytes, Curve25519), which need no quotes in a shell. Lines that begin with # are
comments.
"""

import errno
import os
import re
import stat
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from common.errors import ConfigurationError
from common.files.regular_file import read_regular_file
from common.files.user_folders import configuration_folder

Side = Literal["robot", "operator"]

PEER_LIMIT = 256
"""Maximum number of peers in one folder: far more than one robot has operators, yet read in a few milliseconds."""
_FILE_LIMIT_BYTES = 4096
SHORTAGES = (errno.EMFILE, errno.ENFILE, errno.ENOMEM)
"""Errors that are no fault of the file or folder: this process or the machine lacks descriptors or memory."""
_KEY = re.compile(r"[0-9a-f]{64}")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}")


def default_folder() -> Path:
    """Return the default folder of keys."""
    return configuration_folder() / "keys"


def checked_key(text: str, what: str) -> str:
    """Return `text` as a key in lower case; raises ConfigurationError, which names `what`."""
    key = text.strip().lower()
    if _KEY.fullmatch(key) is None:
        raise ConfigurationError(f"{what}: {text.strip()[:80]!r} is no key; valid: 64 hexadecimal digits")
    return key


def checked_name(name: str) -> str:
    """Return `name` if it is a valid name of a peer, and hence of a file; else raise ConfigurationError."""
    if _NAME.fullmatch(name) is None:
        raise ConfigurationError(
            f"name {name[:80]!r}: valid: 1 to 32 letters, digits, - and _, the first a letter or digit"
        )
    return name


def read_public_key(key_or_file: str, what: str) -> str:
    """Return the public key that `key_or_file` gives by digits or by a file's path. ConfigurationError names `what`."""
    if _KEY.fullmatch(key_or_file.strip().lower()):
        return key_or_file.strip().lower()
    path = Path(key_or_file).expanduser()
    if path.suffix == ".secret":
        raise ConfigurationError(
            f"{what}: {path} is a secret key, which stays where it was made; valid: the .public file"
        )
    if not path.is_file():
        raise ConfigurationError(
            f"{what}: {key_or_file[:80]!r} is neither a key nor a file; valid: 64 hexadecimal digits, or a .public file"
        )
    return _read_key(path, what)


@dataclass(frozen=True)
class Peers:
    """Admitted peers, and faults of files that should admit one."""

    names: dict[str, str]
    """Names of the admitted peers, keyed by their public keys."""
    faults: tuple[str, ...]
    """Faults of files that cannot be used, one line each."""


@dataclass(frozen=True)
class KeyFolder:
    """Folder of keys; every call reads or writes the files."""

    path: Path = field(default_factory=default_folder)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", self.path.expanduser())

    def secret_path(self, side: Side) -> Path:
        """Return the path of the side's secret key."""
        return self.path / f"{side}.secret"

    def public_path(self, side: Side) -> Path:
        """Return the path of the side's public key."""
        return self.path / f"{side}.public"

    @property
    def allowed_path(self) -> Path:
        """Folder with the public keys of the admitted peers."""
        return self.path / "allowed"

    def write_pair(self, side: Side, public: str, secret: str, *, replace: bool = False) -> None:
        """Write the pair of keys of a side; without `replace` raises ConfigurationError if there is a secret key."""
        path = self.secret_path(side)
        if path.exists() and not replace:
            raise ConfigurationError(
                f"{path}: there is a key already; valid: `{self.command(f'show {side}')}` for its public part, "
                "or --replace, after which every peer needs the new one"
            )
        self._make_folder(self.path)
        whose = f"this {side} side"
        _write(
            path,
            f"# The secret key of {whose}: its readers can act as it. It never leaves this machine.\n{secret}\n",
        )
        _write(
            self.public_path(side), f"# The public key of {whose}, to be given to its peers.\n{public}\n", mode=0o644
        )

    def secret(self, side: Side) -> str:
        """Return the side's secret key. Raises ConfigurationError, which names the command that mends the fault."""
        path = self.secret_path(side)
        if not path.is_file():
            raise ConfigurationError(
                f"--keys {self.path}: there is no {path.name}; valid: a folder with one, "
                f"made by `{self.command(f'make {side}')}`"
            )
        mode = stat.S_IMODE(path.stat().st_mode)
        if mode & 0o077:
            raise ConfigurationError(
                f"--keys {self.path}: others may read {path.name} (mode {mode:04o}); valid: mode 0600, "
                f"set by `chmod 600 {path}`"
            )
        return _read_key(path, "--keys")

    def allow(self, name: str, public: str) -> None:
        """Admit a peer; raises ConfigurationError if the name or key is taken, or the folder is full."""
        peers = self.allowed()
        if peers.get(public, name) != name:
            raise ConfigurationError(f"this key is allowed already, as {peers[public]!r}")
        if name in peers.values() and public not in peers:
            raise ConfigurationError(
                f"name {name!r}: belongs to another key; valid: another name, "
                f"or `{self.command(f'revoke {name}')}` first"
            )
        if len(peers) >= PEER_LIMIT:
            raise ConfigurationError(f"{len(peers)} peers are allowed already; valid: up to {PEER_LIMIT}")
        self._make_folder(self.path)
        self._make_folder(self.allowed_path)
        _write(self.peer_path(name), f"# A peer that is let in as {name}; deleting this file revokes it.\n{public}\n")

    def revoke(self, name: str) -> None:
        """Revoke a peer; raises ConfigurationError if there is none of that name, or another name has the same key."""
        path = self.peer_path(name)
        if not path.is_file():
            names = ", ".join(sorted(self.allowed().values())) or "none is allowed"
            raise ConfigurationError(f"name {name!r}: no such peer in {self.allowed_path}; valid: {names}")
        key = _read_key(path, "allowed")
        path.unlink()
        if (other := self.allowed().get(key)) is not None:
            raise ConfigurationError(
                f"{name} is gone, but the same key is still let in as {other}; "
                f"valid: `{self.command(f'revoke {other}')}`, too"
            )

    def allowed(self) -> dict[str, str]:
        """Return the names of the admitted peers, keyed by their public keys; errors as in `peers`."""
        return self.peers().names

    def peers(self) -> Peers:
        """Read the admitted peers. A file that cannot be read, or has vanished, excludes only its own key.

        Raises ConfigurationError if the folder is unreadable or writable for others; OSError if descriptors or memory
        are short (SHORTAGES).
        """
        names: dict[str, str] = {}
        faults = []
        for path in self._allowed_files():
            try:
                if _NAME.fullmatch(path.stem) is None:
                    raise ConfigurationError(
                        f"allowed: {path}: its name is no peer's; valid: letters, digits, - and _, then .public"
                    )
                key = _read_key(path, "allowed")
            except ConfigurationError as error:
                faults.append(str(error))
            else:
                names[key] = f"{names[key]}, {path.stem}" if key in names else path.stem
        return Peers(names, tuple(faults))

    def fingerprint(self) -> tuple[tuple[str, int, int], ...]:
        """Return a value that changes when the admitted peers change, without reading the files.

        It has each file's name, time of change and inode. Errors as in `peers`.
        """
        return tuple((path.name, *_stand(path)) for path in self._allowed_files())

    def command(self, rest: str) -> str:
        """Return the command line `feelahead keys REST` for this folder."""
        folder = "" if self.path == default_folder() else f" --folder {self.path}"
        return f"feelahead keys {rest}{folder}"

    def peer_path(self, name: str) -> Path:
        """Return the path of a peer's public key; raises ConfigurationError for an invalid name."""
        return self.allowed_path / f"{checked_name(name)}.public"

    def _allowed_files(self) -> list[Path]:
        try:
            # glob would treat an unreadable folder as an empty one.
            paths = sorted(self.allowed_path.iterdir())
        except FileNotFoundError:
            return []
        except OSError as error:
            if error.errno in SHORTAGES:
                raise
            raise ConfigurationError(
                f"{self.allowed_path}: cannot be read: {error.strerror}; valid: a folder of this user's, mode 0700"
            ) from error
        _refuse_writable(self.allowed_path)
        files = [path for path in paths if path.suffix == ".public" and not path.name.startswith(".")]
        if len(files) > PEER_LIMIT:
            raise ConfigurationError(f"{self.allowed_path}: {len(files)} peers; valid: up to {PEER_LIMIT}")
        return files

    @staticmethod
    def _make_folder(path: Path) -> None:
        try:
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(f"--folder {path}: cannot be made: {error.strerror}") from error


def _read_key(path: Path, what: str) -> str:
    try:
        content = read_regular_file(path, _FILE_LIMIT_BYTES).decode("ascii")
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{what}: {path} cannot be read: no ASCII text; valid: a key file") from error
    except OSError as error:
        if error.errno in SHORTAGES:
            raise
        raise ConfigurationError(f"{what}: {path} cannot be read: {error.strerror}; valid: a key file") from error
    except ValueError as error:
        raise ConfigurationError(f"{what}: {path} {error}") from error
    lines = [line for line in content.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) != 1:
        raise ConfigurationError(f"{what}: {path} holds {len(lines)} lines; valid: one key of 64 hexadecimal digits")
    return checked_key(lines[0], f"{what}: {path}")


def _stand(path: Path) -> tuple[int, int]:
    """Return a file's time of change and inode; for an unreadable one, -1 and the error's number."""
    try:
        found = path.stat()
    except OSError as error:
        return -1, error.errno or 0
    return found.st_ctime_ns, found.st_ino


def _refuse_writable(path: Path) -> None:
    mode = stat.S_IMODE(path.stat().st_mode)
    if mode & 0o022:
        raise ConfigurationError(
            f"{path}: others may write there (mode {mode:04o}) and let anyone in; valid: mode 0700, "
            f"set by `chmod 700 {path}`"
        )


def _write(path: Path, content: str, mode: int = 0o600) -> None:
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
