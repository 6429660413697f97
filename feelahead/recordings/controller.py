"""Read a recording's entries of the controller."""

from typing import TypeVar

import msgspec

from common.errors import RemoteProtocolError

_Value = TypeVar("_Value")


def read_value(content: bytes, kind: type[_Value]) -> _Value:
    """Read a controller's state (Kind.HANDS) or effects (Kind.TOLD); raises RemoteProtocolError if it is invalid."""
    try:
        return msgspec.msgpack.decode(content, type=kind)
    except msgspec.MsgspecError as error:
        raise RemoteProtocolError(f"a recorded {kind.__name__} is invalid: {error}") from error
