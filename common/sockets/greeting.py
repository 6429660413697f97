"""Greeting that a ZeroMQ peer sends on a TCP connection (ZMTP 3, rfc.zeromq.org/spec/23), read without ZeroMQ."""

from typing import Final

KNOCK: Final = b"\xff" + bytes(8) + b"\x7f\x03\x00"
"""First bytes to send to a peer: signature and version 3.0, after which the peer sends its whole greeting."""
GREETING_BYTES: Final = 64


def mechanism_of(greeting: bytes) -> str | None:
    """Return the security mechanism that a whole greeting names, such as CURVE; None if it is not ZMTP 3 or newer."""
    is_zmtp = len(greeting) >= GREETING_BYTES and greeting[0] == KNOCK[0] and greeting[9] == KNOCK[9]
    if not is_zmtp or greeting[10] < KNOCK[10]:
        return None
    return greeting[12:32].rstrip(b"\0").decode("ascii", "replace")
