"""Greeting of a ZeroMQ peer on a TCP connection (ZMTP 3, rfc.zeromq.org/spec/23), without ZeroMQ."""

from typing import Final

KNOCK: Final = b"\xff" + bytes(8) + b"\x7f\x03\x00"
"""Signature and version 3.0: enough for a peer to send its whole greeting."""
GREETING_BYTES: Final = 64


def mechanism_of(greeting: bytes) -> str | None:
    """Return the security mechanism of a whole greeting, such as CURVE; None unless it is of version 3."""
    is_zmtp = len(greeting) >= GREETING_BYTES and greeting[0] == KNOCK[0] and greeting[9] == KNOCK[9]
    if not is_zmtp or greeting[10] < KNOCK[10]:
        return None
    return greeting[12:32].rstrip(b"\0").decode("ascii", "replace")
