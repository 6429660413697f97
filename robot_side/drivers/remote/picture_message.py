"""Message of a camera process to the robot side, and the answers (docs/drivers.md): maps in MessagePack."""

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct

from common.errors import RemoteProtocolError
from common.protocol.view_messages import ViewName
from robot_side.drivers.remote.sender_clock import Stamped, decoded_stamped

PICTURE_VERSION: Final = 1
PICTURE_LIMIT_BYTES: Final = 1024 * 1024
LEAST_PIXELS: Final = 16
MOST_PIXELS: Final = 1920
"""Limits of a picture's width and height"""
_JPEG: Final = b"\xff\xd8\xff"
_COLORS: Final = 3

_Pixels = Annotated[int, Meta(ge=LEAST_PIXELS, le=MOST_PIXELS)]
_Focal = Annotated[float, Meta(gt=0.0, le=1e5)]
_Middle = Annotated[float, Meta(ge=-1e4, le=1e4)]


class Intrinsics(Struct, frozen=True, forbid_unknown_fields=True):
    """Pinhole of a camera, in pixels of the picture as it is sent: x to the right and y down, from the upper left."""

    fx: _Focal
    fy: _Focal
    cx: _Middle
    cy: _Middle


class PictureMessage(Stamped, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Picture of one view; its times are on the sender's clock. Its bytes are not decoded here."""

    view: ViewName
    width: _Pixels
    height: _Pixels
    format: Literal["jpeg", "rgb8"]
    content: bytes = msgspec.field(name="bytes")
    intrinsics: Intrinsics | None = None


_DECODER: Final = msgspec.msgpack.Decoder(PictureMessage)


def read_picture(payload: bytes) -> PictureMessage:
    """Decode a message; RemoteProtocolError names an invalid field. Whether a JPEG is one is found out elsewhere."""
    message = decoded_stamped(payload, _DECODER, PICTURE_VERSION)
    size, expected = len(message.content), _COLORS * message.width * message.height
    if message.format == "rgb8" and size != expected:
        shape = f"{message.width} x {message.height} pixels"
        raise RemoteProtocolError(f"bytes has {size} bytes; valid: {expected}, three for each of {shape} in rgb8")
    if message.format == "jpeg" and not message.content.startswith(_JPEG):
        raise RemoteProtocolError(f"bytes begins with {message.content[:3].hex()!r}; valid: 'ffd8ff' in format jpeg")
    return message
