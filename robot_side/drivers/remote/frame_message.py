"""Message of a perception process to the robot side (docs/drivers.md), and its conversion to a frame of objects."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Annotated, Any, Final

import msgspec
import numpy as np
from msgspec import Meta, Struct
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.limits import Finite
from common.roles import Role
from robot_side.surroundings.perceived import KINDS, PerceivedObjects

FRAME_VERSION: Final = 1
FRAME_LIMIT_BYTES: Final = 1024 * 1024
MOST_OBJECTS: Final = 512
_MOST_TETRAHEDRA: Final = 1024
_UNIT: Final = 0.01
"""Largest deviation of a quaternion's length from 1 that is accepted"""

_Coordinate = Annotated[float, Meta(ge=-1e3, le=1e3)]
_Size = Annotated[float, Meta(gt=0.0, le=1e3)]
_Three = tuple[_Coordinate, _Coordinate, _Coordinate]
_Sizes = tuple[_Size, _Size, _Size]
_Tetrahedron = tuple[_Three, _Three, _Three, _Three]


SHAPES: Final = ("sphere", "box", "ellipsoid", "half_space", "tetrahedra")


class SeenObject(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Perceived object: a name, a pose, and exactly one shape."""

    name: Annotated[str, Meta(min_length=1, max_length=100)]
    role: Role | None = None
    """Role of the object; None: the role that the beginning of its name tells"""
    position_m: _Three = (0.0, 0.0, 0.0)
    quaternion: tuple[_Coordinate, _Coordinate, _Coordinate, _Coordinate] = (1.0, 0.0, 0.0, 0.0)
    """Orientation: quaternion from the object's frame to the world, w first"""
    velocity_m_s: _Three | None = None
    mean_m: _Three = (0.0, 0.0, 0.0)
    """Mean error of the position in m, true minus perceived, per axis"""
    sd_m: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    """Standard deviation of the position's error along each axis, in m"""
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


class ObjectFrame(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Frame of all objects that are present; its times are on the sender's clock."""

    version: int
    sequence: Annotated[int, Meta(ge=0, le=2**53)]
    sent_s: Finite
    taken_s: Finite
    """Time at which the camera took the picture, no later than `sent_s`"""
    objects: Annotated[tuple[SeenObject, ...], Meta(max_length=MOST_OBJECTS)]


FRAME_DECODER: Final = msgspec.msgpack.Decoder(ObjectFrame)


def require_possible(frame: ObjectFrame) -> None:
    """Raise ValueError for a repeated name, no or several shapes, a wrong quaternion, or `taken_s` after `sent_s`."""
    if frame.taken_s > frame.sent_s:
        raise ValueError(f"taken_s = {frame.taken_s}; valid: up to sent_s = {frame.sent_s}")
    names = Counter(thing.name for thing in frame.objects)
    for thing in frame.objects:
        if names[thing.name] > 1:
            raise ValueError(f"{thing.name!r} occurs {names[thing.name]} times; valid: once")
        shapes = sum(bool(getattr(thing, shape)) for shape in SHAPES)
        if shapes != 1:
            raise ValueError(f"{thing.name!r} has {shapes} shapes; valid: exactly one of {', '.join(SHAPES)}")
        if abs(math.hypot(*thing.quaternion) - 1.0) > _UNIT:
            raise ValueError(
                f"{thing.name!r}: quaternion = {thing.quaternion}; valid: a quaternion of length 1, w first"
            )


def perceived(things: Sequence[SeenObject], roles: Sequence[Role], time_s: float) -> PerceivedObjects:
    """Return a frame with these objects, which must be valid, in these roles."""
    quaternions = np.array([thing.quaternion for thing in things]).reshape(-1, 4)
    turned = Rotation.from_quat(quaternions, scalar_first=True).as_matrix() if things else np.empty((0, 3, 3))
    # The known mean error is corrected.
    positions = _rows(np.add(thing.position_m, thing.mean_m) for thing in things)
    arrays: dict[str, Any] = {name: [] for kind in KINDS for name in (*kind.parts, kind.owner)}
    for index, thing in enumerate(things):
        if roles[index] is Role.IGNORED:
            continue
        kind, count, values = _primitives(thing, positions[index], turned[index])
        arrays[f"{kind}_object"] += [index] * count
        for name, value in values.items():
            arrays[name].append(value)
    for one in KINDS:
        arrays[one.owner] = np.array(arrays[one.owner], dtype=np.int64)
        for name, (_, shape) in one.parts.items():
            # An object's tetrahedra, which may be a thousand, are one block.
            blocks = [np.reshape(block, (-1, *shape)) for block in arrays[name]]
            arrays[name] = np.concatenate(blocks, dtype=np.float64) if blocks else np.empty((0, *shape))
    return PerceivedObjects(
        time_s=time_s,
        names=tuple(thing.name for thing in things),
        roles=tuple(roles),
        positions_m=positions,
        rotations=np.ascontiguousarray(turned),
        velocities_m_s=_velocities(things),
        **arrays,
    )


def _velocities(things: Sequence[SeenObject]) -> FloatArray | None:
    """Return the objects' velocities (k, 3), 0 for those without one; None if no object has one."""
    if all(thing.velocity_m_s is None for thing in things):
        return None
    return _rows(thing.velocity_m_s or (0.0, 0.0, 0.0) for thing in things)


def _primitives(thing: SeenObject, position: FloatArray, turned: FloatArray) -> tuple[str, int, dict[str, Any]]:
    """Return the kind of the object's shape, the number of its primitives, and their values in the frame's arrays."""
    if thing.sphere is not None:
        return "sphere", 1, {"sphere_centers_m": position, "sphere_radii_m": thing.sphere}
    if thing.tetrahedra is not None:
        corners = np.array(thing.tetrahedra) @ turned.T + position
        return "tetrahedron", len(corners), {"tetrahedron_vertices_m": corners}
    if thing.half_space:
        normal = turned[:, 2] / np.linalg.norm(turned[:, 2])
        return "half_space", 1, {"half_space_normals": normal, "half_space_offsets_m": normal @ position}
    kind, sizes, name = ("box", thing.box, "half_sizes") if thing.box else ("ellipsoid", thing.ellipsoid, "half_axes")
    return kind, 1, {f"{kind}_centers_m": position, f"{kind}_rotations": turned, f"{kind}_{name}_m": sizes}


def _rows(values: Iterable[Any]) -> FloatArray:
    found: FloatArray = np.array([*values], dtype=np.float64).reshape(-1, 3)
    return found
