"""What the robot side and the process that renders for it say to each other.

robot side ── Setup, Order ──▶ companion
robot side ◀── Picture, Refusal ── companion
"""

from typing import Final

import msgspec

from common.protocol.view_messages import ViewName

Triple = tuple[float, float, float]


class Viewpoint(msgspec.Struct, frozen=True):
    """From where a view is seen: a camera of the model, or else a pose in the frame of one of its bodies."""

    camera: int | None = None
    body: int = 0
    position_m: Triple = (0.0, 0.0, 0.0)
    forward: Triple = (1.0, 0.0, 0.0)
    """Unit"""
    up: Triple = (0.0, 0.0, 1.0)
    """Unit, at right angles to `forward`"""
    fovy_deg: float = 45.0
    """From the picture's lower edge to its upper one"""


class Setup(msgspec.Struct, frozen=True, tag=True):
    """The first message: what to render, and how."""

    model: bytes
    """As MuJoCo saves it"""
    width: int
    height: int
    quality: int
    """Of JPEG, 1 to 100"""
    viewpoints: dict[ViewName, Viewpoint]


class Order(msgspec.Struct, frozen=True, tag=True):
    """Render one picture of this state."""

    view: ViewName
    captured_s: float
    positions: bytes
    """qpos, float64"""
    mocap_poses: bytes
    """(b, 7) float64: positions and quaternions of bodies that are moved by hand"""


class Picture(msgspec.Struct, frozen=True, tag=True):
    """What was ordered."""

    view: ViewName
    captured_s: float
    """The order's"""
    jpeg: bytes
    took_s: float
    """From reading the order to the finished picture"""


class Refusal(msgspec.Struct, frozen=True, tag=True):
    """Nothing will ever be rendered here: why, and what would help."""

    reason: str


encode: Final = msgspec.msgpack.Encoder().encode
decode_to_companion: Final = msgspec.msgpack.Decoder(Setup | Order).decode
decode_from_companion: Final = msgspec.msgpack.Decoder(Picture | Refusal).decode
