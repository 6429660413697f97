"""Messages to bytes and back: MessagePack, then conversion into the frozen types of common.protocol.messages.

A payload is `[version, message]`. The version is read first, so that a peer of another version is told apart
from garbage.
"""

from typing import Any

import msgpack
import msgspec

from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.messages import AnyMessage, Message

PROTOCOL_VERSION = 5
"""2: the lease, with its token in every command. 3: predicted contact in each stiffness. 4: a field for
each trigger in place of stiffness and contact, and in each command who reckons with the delay."""
MAXIMUM_BYTES = 4096
"""The largest message is an eighth of this; a longer payload is not looked into."""


def encode(message: Message) -> bytes:
    """Pack one message."""
    payload: bytes = msgpack.packb([PROTOCOL_VERSION, msgspec.to_builtins(message)])
    return payload


def decode(payload: bytes) -> AnyMessage:
    """Unpack and validate one message whole; RemoteProtocolError says what is wrong with the bytes.

    OtherVersionError, a kind of it, for a peer of another version, whatever else the bytes hold.
    """
    if len(payload) > MAXIMUM_BYTES:
        raise RemoteProtocolError(f"a payload of {len(payload)} bytes; valid: up to {MAXIMUM_BYTES}")
    try:
        body: Any = msgpack.unpackb(payload)
    # msgpack raises ValueError and its subclasses for bad bytes, and TypeError or OverflowError for odd keys.
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise RemoteProtocolError(f"no MessagePack: {error}") from error
    if not isinstance(body, list) or len(body) != 2:
        raise RemoteProtocolError("no [version, message] pair")
    version, content = body
    if type(version) is not int or version < 0:
        raise RemoteProtocolError(f"protocol version {version!r:.40}; valid: {PROTOCOL_VERSION}")
    if version != PROTOCOL_VERSION:
        raise OtherVersionError(f"protocol version {version!s:.40}; valid: {PROTOCOL_VERSION}")
    try:
        message: AnyMessage = msgspec.convert(content, AnyMessage)
    except msgspec.ValidationError as error:
        raise RemoteProtocolError(f"no valid message: {error}") from error
    return message
