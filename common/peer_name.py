"""Name of a peer: a digest of its authenticated key, followed by a part that identifies the process."""

import hashlib
from typing import Final

_KEY_BYTES: Final = 16
_DRIVES, _OBSERVES = b"\x00", b"\x01"


def peer_name(key: str, group: bytes, *, observes: bool = False) -> bytes:
    """Return a peer's name: whether it only observes, a digest of its key, and `group`, which identifies the process.

    The digest is zeros if `key` is empty.
    """
    digest = hashlib.sha256(key.encode()).digest()[: _KEY_BYTES - 1] if key else bytes(_KEY_BYTES - 1)
    return (_OBSERVES if observes else _DRIVES) + digest + group


def may_drive(name: bytes) -> bool:
    """Return whether a peer may own the lease."""
    return not name.startswith(_OBSERVES)


def key_part(name: bytes) -> bytes:
    """Return the part of a peer's name that depends only on the key, and so is equal for all peers with the key."""
    return name[:_KEY_BYTES]
