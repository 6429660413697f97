"""Name of a peer: a digest of its authenticated key, followed by a part that identifies the process."""

import hashlib
from typing import Final

_KEY_BYTES: Final = 16


def peer_name(key: str, group: bytes) -> bytes:
    """Return a peer's name: a digest of `key` (zeros if `key` is empty), then `group`, which identifies the process."""
    digest = hashlib.sha256(key.encode()).digest()[:_KEY_BYTES] if key else bytes(_KEY_BYTES)
    return digest + group


def key_part(name: bytes) -> bytes:
    """Return the part of a peer's name that depends only on the key, and so is equal for all peers with the key."""
    return name[:_KEY_BYTES]
