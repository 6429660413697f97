"""Messages of a perception process to the robot side, and the answers (docs/drivers.md): maps in MessagePack."""

import math
from typing import Annotated, Final

import msgspec
from msgspec import Meta, Struct

from common.errors import RemoteProtocolError
from common.roles import Role
from robot_side.drivers.remote.messages import BAD_BYTES
from robot_side.drivers.remote.sender_clock import Stamped, decoded_stamped

FRAME_VERSION: Final = 1
FRAME_LIMIT_BYTES: Final = 1024 * 1024
MOST_OBJECTS: Final = 4096
_MOST_TETRAHEDRA: Final = 1024
MOST_MESHES: Final = 256
MOST_TRIANGLES: Final = 200_000
"""Maximum number of meshes that the robot side keeps, and of their triangles"""
_UNIT: Final = 0.01
"""Largest deviation of a quaternion's length from 1 that is accepted"""

_Coordinate = Annotated[float, Meta(ge=-1e3, le=1e3)]
_Size = Annotated[float, Meta(gt=0.0, le=1e3)]
_Three = tuple[_Coordinate, _Coordinate, _Coordinate]
_Sizes = tuple[_Size, _Size, _Size]
_Tetrahedron = tuple[_Three, _Three, _Three, _Three]
_Name = Annotated[str, Meta(min_length=1, max_length=100)]
_Corner = Annotated[int, Meta(ge=0, lt=2**31)]

SHAPES: Final = ("sphere", "box", "ellipsoid", "half_space", "tetrahedra", "mesh")


class SeenObject(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Perceived object: a name, a pose, and exactly one shape."""

    name: _Name
    role: Role | None = None
    """Role of the object; None: the role that the beginning of its name tells"""
    position_m: _Three = (0.0, 0.0, 0.0)
    quaternion: tuple[_Coordinate, _Coordinate, _Coordinate, _Coordinate] = (1.0, 0.0, 0.0, 0.0)
    """Orientation: quaternion from the object's frame to the world, w first"""
    velocity_m_s: _Three | None = None
    mean_m: _Three = (0.0, 0.0, 0.0)
    """Mean error of the position in m, true minus perceived, per axis"""
    sd_m: Annotated[float, Meta(ge=0.0, le=1.0)] | None = None
    """Standard deviation of the position's error along each axis, in m; None: --camera.sd-m"""
    sphere: _Size | None = None
    """Radius of a sphere, in m"""
    box: _Sizes | None = None
    """Half sizes of a box, in m"""
    ellipsoid: _Sizes | None = None
    """Half axes of an ellipsoid, in m"""
    half_space: bool = False
    """Whether the shape is a half-space, solid where z <= 0 in the object's frame"""
    tetrahedra: Annotated[tuple[_Tetrahedron, ...], Meta(min_length=1, max_length=_MOST_TETRAHEDRA)] | None = None
    """Four corners of each tetrahedron, in m in the object's frame"""
    mesh: _Name | None = None
    """Name of a mesh that this frame or an earlier one has defined"""

    def require_possible(self) -> None:
        """Raise ValueError for no or several shapes, or a wrong quaternion."""
        shapes = sum(bool(getattr(self, shape)) for shape in SHAPES)
        if shapes != 1:
            raise ValueError(f"{self.name!r} has {shapes} shapes; valid: exactly one of {', '.join(SHAPES)}")
        if abs(math.hypot(*self.quaternion) - 1.0) > _UNIT:
            raise ValueError(f"{self.name!r}: quaternion = {self.quaternion}; valid: a quaternion of length 1, w first")


class SentMesh(Struct, frozen=True, forbid_unknown_fields=True):
    """Shape for objects: a closed surface of triangles."""

    vertices: tuple[_Three, ...]
    """Corners in m, in the object's frame"""
    triangles: tuple[tuple[_Corner, _Corner, _Corner], ...]
    """Indices of three corners each, anticlockwise as seen from outside"""


class ObjectFrame(Stamped, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Frame of all objects that are present; its times are on the sender's clock."""

    meshes: Annotated[dict[_Name, msgspec.Raw], Meta(max_length=MOST_MESHES)] = {}  # noqa: RUF012  # a struct has its own
    """Meshes by name, each a `SentMesh`; they count in this frame and in all later ones"""
    objects: Annotated[tuple[msgspec.Raw, ...], Meta(max_length=MOST_OBJECTS)]
    """Objects, each a `SeenObject`; decoded some at a time"""


class FrameRefusal(Struct, frozen=True, omit_defaults=True):
    """Reason why the last frame was rejected."""

    version: int
    refused: str
    unknown_meshes: tuple[str, ...] = ()
    """Meshes that objects refer to, but that no frame has defined"""


_FRAME: Final = msgspec.msgpack.Decoder(ObjectFrame)
_OBJECT: Final = msgspec.msgpack.Decoder(SeenObject)
_MESH: Final = msgspec.msgpack.Decoder(SentMesh)
DEFINES_MESHES: Final = b"\xa6meshes"
"""Bytes that every frame with meshes has: their key"""


class UnknownMeshError(ValueError):
    """Objects refer to meshes that no frame has defined."""

    def __init__(self, names: tuple[str, ...]) -> None:
        text = "valid: a mesh that this frame or an earlier one defines in meshes: send it again"
        super().__init__(f"mesh = {names[0]!r} is not known; {text}")
        self.names = names


def read_frame(payload: bytes) -> ObjectFrame:
    """Decode a frame, without its objects and meshes; RemoteProtocolError names an invalid field."""
    return decoded_stamped(payload, _FRAME, FRAME_VERSION)


def read_object(frame: ObjectFrame, number: int) -> SeenObject:
    """Decode one object of a frame; RemoteProtocolError or ValueError names an invalid field."""
    try:
        thing = _OBJECT.decode(frame.objects[number])
    except BAD_BYTES as error:
        raise RemoteProtocolError(f"objects[{number}]: {error!s:.300}; valid: fields as in docs/drivers.md") from error
    thing.require_possible()
    return thing


def read_mesh(frame: ObjectFrame, name: str) -> SentMesh:
    """Decode one mesh of a frame; RemoteProtocolError names an invalid field."""
    try:
        return _MESH.decode(frame.meshes[name])
    except BAD_BYTES as error:
        raise RemoteProtocolError(f"meshes: {name!r}: {error!s:.300}; valid: vertices and triangles") from error
