"""What the robot side and the process that renders for it say to each other.

robot side ── Setup, Order ──▶ companion
robot side ◀── Ready, Picture, Refusal ── companion
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
    viewpoints: dict[ViewName, Viewpoint]
    h264: bool = False
    """Whether pictures in H.264 may be ordered"""


class Order(msgspec.Struct, frozen=True, tag=True):
    """Render one picture of this state."""

    view: ViewName
    captured_s: float
    positions: bytes
    """qpos, float64"""
    mocap_poses: bytes
    """(b, 7) float64: positions and quaternions of bodies that are moved by hand"""
    quality: int
    """As JPEG's, 1 to 100"""
    halved: bool = False
    """Half as wide and half as high"""
    h264: bool = False
    """Instead of JPEG"""
    whole: bool = False
    """Make a whole picture: somebody lacks the picture before this one"""


class Ready(msgspec.Struct, frozen=True, tag=True):
    """The answer to Setup: orders are served from now on."""

    h264: bool
    trouble: str = ""
    """Why PyAV, which is installed, makes no H.264"""


class Picture(msgspec.Struct, frozen=True, tag=True):
    """What was ordered."""

    view: ViewName
    captured_s: float
    """The order's"""
    width: int
    height: int
    content: bytes
    took_s: float
    """From reading the order to the finished picture"""
    number: int = 0
    """Of a picture in H.264, growing by one for each of a view; 0: it is JPEG"""
    whole: bool = True
    """Whether it can be shown without any other"""


class Refusal(msgspec.Struct, frozen=True, tag=True):
    """Nothing will ever be rendered here: why, and what would help."""

    reason: str


encode: Final = msgspec.msgpack.Encoder().encode
decode_to_companion: Final = msgspec.msgpack.Decoder(Setup | Order).decode
decode_from_companion: Final = msgspec.msgpack.Decoder(Ready | Picture | Refusal).decode
