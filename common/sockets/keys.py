"""Keys as text files: this side's own pair, and the public keys of the peers that it admits.

    FOLDER/robot.secret        the robot side's secret key (mode 0600)
    FOLDER/robot.public        its public part, to be given to the operators
    FOLDER/allowed/NAME.public the public key and the role of an admitted peer; deleting the file revokes it

A key is 64 hexadecimal digits (32 bytes, Curve25519), which need no quotes in a shell. Lines that begin with # are
comments.
"""

import re
import stat
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from common.errors import ConfigurationError
from common.files.user_folders import configuration_folder
from common.sockets.key_files import (
    SHORTAGES,
    KeyRole,
    is_key,
    read_key,
    read_peer,
    refuse_others,
    stand,
    write_key_file,
)

Side = Literal["robot", "operator"]

PEER_LIMIT = 256
"""Maximum number of peers in one folder: far more operators than one robot has, and read in a few milliseconds."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}")


def default_folder() -> Path:
    """Return the default folder of keys."""
    return configuration_folder() / "keys"


def checked_name(name: str) -> str:
    """Return `name` if it is a valid name of a peer, and hence of a file; else raise ConfigurationError."""
    if _NAME.fullmatch(name) is None:
        raise ConfigurationError(
            f"name {name[:80]!r}: is no peer's name; valid: 1 to 32 letters, digits, - and _; first a letter or digit"
        )
    return name


def read_public_key(key_or_file: str, what: str) -> str:
    """Return the public key that `key_or_file` gives by digits or by a file's path. ConfigurationError names `what`."""
    if is_key(key := key_or_file.strip().lower()):
        return key
    path = Path(key_or_file).expanduser()
    if path.suffix == ".secret":
        raise ConfigurationError(
            f"{what}: {path} is a secret key, which must not leave its machine; valid: the .public file beside it"
        )
    if not path.is_file():
        raise ConfigurationError(
            f"{what}: {key_or_file[:80]!r} is neither a key nor a file; valid: 64 hexadecimal digits, or a .public file"
        )
    return read_key(path, what, guarded=False)


@dataclass(frozen=True)
class Peers:
    """Admitted peers, and faults of files that should admit one."""

    names: dict[str, str]
    """Names of the admitted peers, keyed by their public keys."""
    roles: dict[str, KeyRole]
    """Roles of the admitted peers, keyed likewise"""
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
                f"{path}: there is a key already; valid: `{self.command(f'show {side}')}` to see its public part, "
                "or --replace to make a new key, which every peer then needs"
            )
        self._make_folder(self.path)
        whose = f"this {side} side"
        write_key_file(
            path,
            f"# The secret key of {whose}: its readers can act as it. It never leaves this machine.\n{secret}\n",
        )
        write_key_file(
            self.public_path(side), f"# The public key of {whose}, to be given to its peers.\n{public}\n", mode=0o644
        )

    def secret(self, side: Side) -> str:
        """Return the side's secret key. Raises ConfigurationError, which names the command that mends the fault."""
        path = self.secret_path(side)
        if not path.is_file():
            raise ConfigurationError(
                f"--keys {self.path}: the folder has no {path.name}; valid: a folder with this file, "
                f"made by `{self.command(f'make {side}')}`"
            )
        mode = stat.S_IMODE(path.stat().st_mode)
        if mode & 0o077:
            raise ConfigurationError(
                f"--keys {self.path}: other users may read {path.name} (mode {mode:04o}); valid: mode 0600, "
                f"set by `chmod 600 {path}`"
            )
        return read_key(path, "--keys")

    def allow(self, name: str, public: str, role: KeyRole = "operator") -> None:
        """Admit a peer, or change its role. ConfigurationError if the name or key is taken, or the folder is full."""
        peers = self.allowed()
        if peers.get(public, name) != name:
            raise ConfigurationError(
                f"name {name!r}: its key is allowed already, as {peers[public]!r}; valid: a key that has no name yet"
            )
        if name in peers.values() and public not in peers:
            raise ConfigurationError(
                f"name {name!r}: belongs to another key; valid: another name, "
                f"or `{self.command(f'revoke {name}')}` first"
            )
        if len(peers) >= PEER_LIMIT:
            raise ConfigurationError(
                f"name {name!r}: {len(peers)} peers are allowed already; valid: up to {PEER_LIMIT} peers"
            )
        self._make_folder(self.path)
        self._make_folder(self.allowed_path)
        write_key_file(
            self.peer_path(name),
            f"# A peer that is let in as {name}; deleting this file revokes it.\n{public}\n{role}\n",
        )

    def revoke(self, name: str) -> None:
        """Revoke a peer; raises ConfigurationError if there is none of that name, or another name has the same key."""
        path = self.peer_path(name)
        if not path.is_file():
            names = ", ".join(sorted(self.allowed().values())) or "none, as no peer is allowed yet"
            raise ConfigurationError(f"name {name!r}: no such peer in {self.allowed_path}; valid: {names}")
        key, _ = read_peer(path)
        path.unlink()
        if (other := self.allowed().get(key)) is not None:
            raise ConfigurationError(
                f"{name} is revoked, but the same key is still let in as {other}; "
                f"valid: `{self.command(f'revoke {other}')}` to revoke it as well"
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
        roles: dict[str, KeyRole] = {}
        faults = []
        for path in self._allowed_files():
            try:
                if _NAME.fullmatch(path.stem) is None:
                    raise ConfigurationError(
                        f"allowed: {path}: its name is no peer's name; valid: letters, digits, - and _, then .public"
                    )
                key, role = read_peer(path)
                if roles.get(key, role) != role:
                    raise ConfigurationError(
                        f"allowed: {path}: its key is {roles[key]}'s by another name; valid: one role for each key"
                    )
            except ConfigurationError as error:
                faults.append(str(error).encode("utf-8", "backslashreplace").decode())  # a name may be no text
            else:
                names[key], roles[key] = f"{names[key]}, {path.stem}" if key in names else path.stem, role
        return Peers(names, roles, tuple(faults))

    def fingerprint(self) -> tuple[tuple[str, int, int], ...]:
        """Return a value that changes when the admitted peers change, without reading the files.

        It has each file's name, time of change and inode. Errors as in `peers`.
        """
        return tuple((path.name, *stand(path)) for path in self._allowed_files())

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
                f"{self.allowed_path}: cannot be read: {error.strerror}; valid: a folder that belongs to this user,"
                " with mode 0700"
            ) from error
        refuse_others(self.path)
        refuse_others(self.allowed_path)
        files = [path for path in paths if path.suffix == ".public" and not path.name.startswith(".")]
        if len(files) > PEER_LIMIT:
            raise ConfigurationError(
                f"{self.allowed_path}: the folder holds {len(files)} peers; valid: up to {PEER_LIMIT}"
            )
        return files

    @staticmethod
    def _make_folder(path: Path) -> None:
        try:
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(
                f"--folder {path}: cannot be made: {error.strerror}; valid: a folder that this user may make"
            ) from error
