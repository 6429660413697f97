"""Codec of messages: the frozen types of common.protocol.messages to MessagePack bytes, and back.

A payload is `[version, message]`. The version is decoded first, so that a peer of another version is not taken for
garbage. Stiffness and telemetry are sent in packed form (common/protocol/compact.py).
"""

import struct
from typing import Final, TypeVar

import msgspec

from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.compact import AnyOnWire, packed, unpacked
from common.protocol.messages import AnyMessage, Header, Message
from common.protocol.view_messages import AnyViewMessage

Kind = TypeVar("Kind")

PROTOCOL_VERSION = 12
"""What each version added. 2: the lease, with its token in every command. 3: predicted contact in each stiffness.
4: a field for each trigger in place of stiffness and contact, and the compensating side in each command. 6: Watch.
7: packed form of stiffness and telemetry. 8: onset distances around the gripper, and whether the held object is
supported. 9: `Around.changes`. 10: `SceneState.near`, `SceneShapes.eye` and `Mark`.
11: what a viewer keeps up with, in Watch. 12: `StiffnessUpdate.response_s`, `Eye.stretch` and `Eye.middle`."""
MAXIMUM_BYTES = 4096
"""Longest control payload that is decoded, in bytes: eight times the largest message."""
VIEW_MAXIMUM_BYTES: Final = 4 * 1024 * 1024
"""Longest view payload that is decoded, in bytes; common/sockets refuses longer ones, too."""


_ENCODER: Final = msgspec.msgpack.Encoder()
_PAIR: Final = msgspec.msgpack.Decoder(tuple[int, msgspec.Raw])
_MESSAGE: Final["msgspec.msgpack.Decoder[AnyOnWire]"] = msgspec.msgpack.Decoder(AnyOnWire)
_VIEW_MESSAGE: Final["msgspec.msgpack.Decoder[AnyViewMessage]"] = msgspec.msgpack.Decoder(AnyViewMessage)
_BAD_BYTES: Final = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)


def encode(message: Message) -> bytes:
    """Pack one message."""
    return _ENCODER.encode((PROTOCOL_VERSION, packed(message)))


class Prepared:
    """Message that is encoded once and sent with many headers."""

    def __init__(self, message: Message) -> None:
        # No bytes before the header can equal it.
        self._before, _, self._after = encode(message).partition(_ENCODER.encode(message.header))

    def under(self, header: Header) -> bytes:
        """Return the payload of the message with this header."""
        return b"".join((self._before, _ENCODER.encode(header), self._after))


def decode(payload: bytes) -> AnyMessage:
    """Decode and validate one control message. Raises RemoteProtocolError, which names the fault.

    The subclass OtherVersionError means that the peer has another protocol version; the rest is not examined.
    """
    message = _decode(payload, _MESSAGE, MAXIMUM_BYTES)
    try:
        return unpacked(message)
    except (ValueError, struct.error) as error:
        raise RemoteProtocolError(f"no valid message: {error}") from error


def decode_view(payload: bytes) -> AnyViewMessage:
    """Decode a view message; errors as in `decode`."""
    return _decode(payload, _VIEW_MESSAGE, VIEW_MAXIMUM_BYTES)


def claims_to_be(tag: str, payload: bytes) -> bool:
    """Return whether `payload` begins like a message of this tag; the rest is not decoded and may be invalid."""
    # The tag follows a list's first byte, the version, and the first bytes of another list and of the tag.
    return tag.encode() in payload[: 8 + len(tag)]


def _decode(payload: bytes, decoder: "msgspec.msgpack.Decoder[Kind]", limit_bytes: int) -> Kind:
    if len(payload) > limit_bytes:
        raise RemoteProtocolError(f"a payload of {len(payload)} bytes; valid: up to {limit_bytes}")
    try:
        version, content = _PAIR.decode(payload)
    except msgspec.ValidationError as error:
        raise RemoteProtocolError(f"no [version, message] pair: {error}") from error
    except _BAD_BYTES as error:
        raise RemoteProtocolError(f"no MessagePack: {error}") from error
    if version < 0:
        raise RemoteProtocolError(f"protocol version {version}; valid: {PROTOCOL_VERSION}")
    if version != PROTOCOL_VERSION:
        raise OtherVersionError(f"protocol version {version}; valid: {PROTOCOL_VERSION}")
    try:
        return decoder.decode(content)
    except _BAD_BYTES as error:
        raise RemoteProtocolError(f"no valid message: {error}") from error
