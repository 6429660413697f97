"""The name of a peer: as whom it authenticated, then which one of that key's processes it is."""

import hashlib
from typing import Final

_KEY_BYTES: Final = 16


def peer_name(key: str, group: bytes) -> bytes:
    """Put a digest of `key` (zeros without keys) in front of `group`, which tells processes of one key apart."""
    digest = hashlib.sha256(key.encode()).digest()[:_KEY_BYTES] if key else bytes(_KEY_BYTES)
    return digest + group


def key_part(name: bytes) -> bytes:
    """Return the part of a peer's name that its key alone makes: equal for all connections of the key."""
    return name[:_KEY_BYTES]
