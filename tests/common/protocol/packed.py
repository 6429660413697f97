"""Messages as MessagePack, by another library than the codec's."""

import msgpack
import msgspec

from common.protocol.codec import PROTOCOL_VERSION
from common.protocol.messages import Message


def packed_by_msgpack(message: Message) -> bytes:
    """What crosses the link for `message`."""
    payload: bytes = msgpack.packb([PROTOCOL_VERSION, msgspec.to_builtins(message, builtin_types=(bytes,))])
    return payload
