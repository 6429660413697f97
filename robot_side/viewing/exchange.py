"""Messages between the robot side and its rendering process.

robot side ── Setup, Order ──▶ companion
robot side ◀── Ready, Picture, Undecodable, Refusal ── companion
"""

from typing import Final, Literal

import msgspec

from common.protocol.view_messages import ViewName
from robot_side.drivers.mujoco.viewpoints import Viewpoint


class Setup(msgspec.Struct, frozen=True, tag=True):
    """First message to the companion: model, picture size and viewpoints."""

    model: bytes
    """Model in MuJoCo's binary format"""
    width: int
    height: int
    viewpoints: dict[ViewName, Viewpoint]
    h264: bool = False
    """Whether pictures in H.264 may be ordered"""
    sent: bool = False
    """Whether pictures may be sent, which need no renderer"""


class Sent(msgspec.Struct, frozen=True):
    """Picture from a camera, to be encoded instead of a rendered one; its bytes are a stranger's."""

    width: int
    height: int
    format: Literal["jpeg", "rgb8"]
    content: bytes


class Order(msgspec.Struct, frozen=True, tag=True):
    """Order of one picture of the given state."""

    view: ViewName
    captured_s: float
    positions: bytes
    """MuJoCo's qpos, as float64"""
    mocap_poses: bytes
    """(b, 7) float64: position and quaternion of each mocap body"""
    quality: int
    """Quality on JPEG's scale, 1 to 100"""
    halved: bool = False
    """Whether the picture has half the width and height"""
    h264: bool = False
    """Whether the picture is H.264; else JPEG"""
    whole: bool = False
    """Whether to make a picture that needs no other, because a viewer lacks the picture before this one"""
    sent: Sent | None = None
    """Picture to be encoded; None: the state is rendered"""


class Ready(msgspec.Struct, frozen=True, tag=True):
    """Answer to Setup: from now on orders are served."""

    h264: bool
    trouble: str = ""
    """Reason why the installed PyAV makes no H.264"""
    unrendered: str = ""
    """Reason why only sent pictures are served, and what to do about it"""


class Picture(msgspec.Struct, frozen=True, tag=True):
    """Picture that was ordered."""

    view: ViewName
    captured_s: float
    """Time of the state that the picture shows"""
    width: int
    height: int
    content: bytes
    took_s: float
    """Time from reading the order to the finished picture, in seconds"""
    number: int = 0
    """Number of an H.264 picture, growing by one in each view; 0 for JPEG"""
    whole: bool = True
    """Whether the picture can be shown without another picture"""


class Undecodable(msgspec.Struct, frozen=True, tag=True):
    """Answer to an order with a sent picture that cannot be decoded."""

    view: ViewName
    reason: str


class Refusal(msgspec.Struct, frozen=True, tag=True):
    """Refusal of all orders, with the reason and what to do about it."""

    reason: str


encode: Final = msgspec.msgpack.Encoder().encode
decode_to_companion: Final = msgspec.msgpack.Decoder(Setup | Order).decode
decode_from_companion: Final = msgspec.msgpack.Decoder(Ready | Picture | Undecodable | Refusal).decode
