"""Name of a peer: the authenticated key, then the process among that key's."""

import hashlib
from typing import Final

_KEY_BYTES: Final = 16


def peer_name(key: str, group: bytes) -> bytes:
    """Put a digest of `key` (zeros without keys) before `group`, which identifies a process of the key."""
    digest = hashlib.sha256(key.encode()).digest()[:_KEY_BYTES] if key else bytes(_KEY_BYTES)
    return digest + group


def key_part(name: bytes) -> bytes:
    """Return the part of a peer's name that depends only on the key: equal for all connections of the key."""
    return name[:_KEY_BYTES]
