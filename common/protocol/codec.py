"""Messages to bytes and back: MessagePack, then conversion into the frozen types of common.protocol.messages.

A payload is `[version, message]`. The version is read first, so that a peer of another version is told apart
from garbage.
"""

from typing import Any, Final, cast

import msgpack
import msgspec

from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.messages import AnyMessage, Header, Message
from common.protocol.view_messages import AnyViewMessage

PROTOCOL_VERSION = 6
"""2: the lease, with its token in every command. 3: predicted contact in each stiffness. 4: a field for
each trigger in place of stiffness and contact, and in each command who reckons with the delay. 6: who watches what."""
MAXIMUM_BYTES = 4096
"""The largest message is an eighth of this; a longer payload is not looked into."""
VIEW_MAXIMUM_BYTES: Final = 4 * 1024 * 1024
"""The same for what people look at; common/sockets refuses more, too."""


def encode(message: Message) -> bytes:
    """Pack one message."""
    payload: bytes = msgpack.packb([PROTOCOL_VERSION, msgspec.to_builtins(message, builtin_types=(bytes,))])
    return payload


class Prepared:
    """A message packed once, to be sent again and again under other headers."""

    def __init__(self, message: Message) -> None:
        names = message.__struct_fields__
        tag = cast(str, message.__struct_config__.tag)
        packer = msgpack.Packer()
        heads = packer.pack_array_header(2), packer.pack(PROTOCOL_VERSION), packer.pack_array_header(1 + len(names))
        self._before = b"".join((*heads, packer.pack(tag)))
        self._after = b"".join(msgspec.msgpack.encode(getattr(message, name)) for name in names[1:])

    def under(self, header: Header) -> bytes:
        """Pack it under `header`."""
        return b"".join((self._before, msgspec.msgpack.encode(header), self._after))


def decode(payload: bytes) -> AnyMessage:
    """Unpack and validate one message whole; RemoteProtocolError says what is wrong with the bytes.

    OtherVersionError, a kind of it, for a peer of another version, whatever else the bytes hold.
    """
    return cast(AnyMessage, _decode(payload, AnyMessage, MAXIMUM_BYTES))


def decode_view(payload: bytes) -> AnyViewMessage:
    """As `decode`, for what people look at."""
    return cast(AnyViewMessage, _decode(payload, AnyViewMessage, VIEW_MAXIMUM_BYTES))


def claims_to_be(tag: str, payload: bytes) -> bool:
    """Whether `payload` says that it holds a message of this tag; told without unpacking it, so it may still be bad."""
    # Behind a list's first byte, the version, and the first bytes of another list and of the tag.
    return tag.encode() in payload[: 8 + len(tag)]


def _decode(payload: bytes, kinds: Any, limit_bytes: int) -> Any:
    if len(payload) > limit_bytes:
        raise RemoteProtocolError(f"a payload of {len(payload)} bytes; valid: up to {limit_bytes}")
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
        return msgspec.convert(content, kinds)
    except msgspec.ValidationError as error:
        raise RemoteProtocolError(f"no valid message: {error}") from error
