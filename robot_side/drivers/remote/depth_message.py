"""Message of a depth camera's process to the robot side (docs/drivers.md): a map in MessagePack."""

import math
from collections.abc import Mapping
from typing import Annotated, Final

import msgspec
import numpy as np
from msgspec import Meta, Struct

from common.errors import RemoteProtocolError
from common.roles import Role
from robot_side.depth.picture import DepthArray, DepthPicture, Pinhole
from robot_side.drivers.remote.picture_message import Intrinsics
from robot_side.drivers.remote.sender_clock import Stamped, decoded_stamped

DEPTH_VERSION: Final = 1
DEPTH_LIMIT_BYTES: Final = 3 * 1024 * 1024
"""Enough for 1280 x 720 pixels with labels"""
MOST_LABELS: Final = 255
_LEAST_FOCAL, _MOST_FOCAL = 0.2, 20.0
"""Limits of a focal length, in widths or heights of the picture: 136° and 3°"""
_UNIT: Final = 0.01
"""Largest deviation of a quaternion's length from 1 that is accepted"""

_Pixels = Annotated[int, Meta(ge=16, le=1920)]
_Coordinate = Annotated[float, Meta(ge=-100.0, le=100.0)]
_Label = Annotated[int, Meta(ge=1, le=MOST_LABELS)]
_Name = Annotated[str, Meta(min_length=1, max_length=100)]


class SentMount(Struct, frozen=True, forbid_unknown_fields=True):
    """Pose of a camera in the frame of a link, or of the world."""

    link: _Name
    """Name of a link of the model, or world"""
    position_m: tuple[_Coordinate, _Coordinate, _Coordinate]
    quaternion: tuple[_Coordinate, _Coordinate, _Coordinate, _Coordinate]
    """From the camera's frame, whose x is right, y down and z ahead in its picture; w first"""


class DepthMessage(Stamped, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Depth picture of one camera; its times are on the sender's clock."""

    camera: _Name
    width: _Pixels
    height: _Pixels
    depth: bytes
    """Depth along the optical axis in units, 16 bits a pixel, little-endian, row by row; 0 where nothing is measured"""
    depth_unit_m: Annotated[float, Meta(ge=1e-6, le=0.1)]
    intrinsics: Intrinsics
    labels: bytes | None = None
    """Labels of a segmentation, a byte a pixel, row by row; 0: none"""
    roles: Mapping[_Label, Role] = {}
    """Roles by label"""
    mount: SentMount | None = None
    """Where the camera is; None: as the settings say"""

    def picture(self, taken_s: float) -> DepthPicture:
        """Return the picture, taken at `taken_s` on our clock."""
        shape, of = (self.height, self.width), self.intrinsics
        depth_m: DepthArray = np.frombuffer(self.depth, "<u2").astype(np.float32)
        depth_m *= np.float32(self.depth_unit_m)
        labels = None if self.labels is None else np.frombuffer(self.labels, np.uint8).reshape(shape)
        pinhole = Pinhole(of.fx, of.fy, of.cx, of.cy)
        return DepthPicture(taken_s, depth_m.reshape(shape), pinhole, labels, self.roles)


_DECODER: Final = msgspec.msgpack.Decoder(DepthMessage)


def read_depth(payload: bytes) -> DepthMessage:
    """Decode a message; RemoteProtocolError names an invalid field."""
    message = decoded_stamped(payload, _DECODER, DEPTH_VERSION)
    pixels = message.width * message.height
    for name, content, each in (("depth", message.depth, 2), ("labels", message.labels, 1)):
        if content is not None and len(content) != each * pixels:
            shape = f"{message.width} x {message.height} pixels"
            text = f"valid: {each * pixels}, {each} for each of {shape}"
            raise RemoteProtocolError(f"{name} has {len(content)} bytes; {text}")
    of = message.intrinsics
    for name, focal, side in (("fx", of.fx, message.width), ("fy", of.fy, message.height)):
        if not _LEAST_FOCAL * side <= focal <= _MOST_FOCAL * side:
            valid = f"valid: {_LEAST_FOCAL * side:g} to {_MOST_FOCAL * side:g} pixels in pictures of this size"
            raise RemoteProtocolError(f"intrinsics: {name} = {focal}; {valid}")
    if message.roles and message.labels is None:
        raise RemoteProtocolError("roles is there without labels; valid: both, or none")
    mount = message.mount
    if mount is not None and abs(math.hypot(*mount.quaternion) - 1.0) > _UNIT:
        text = "valid: a quaternion of length 1, w first"
        raise RemoteProtocolError(f"mount: quaternion = {mount.quaternion}; {text}")
    return message
