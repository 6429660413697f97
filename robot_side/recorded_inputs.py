"""Arm states and frames of perceived objects as MessagePack and back: the inputs of the robot side's core.

Arrays are the bytes of float64 or int64 values, bit for bit as the core got them.
"""

import math
from collections.abc import Mapping
from typing import Any, Final, TypeVar

import msgspec
import numpy as np

from robot_side.arm.port import ArmState
from robot_side.objects.perceived import PerceivedObjects, Role

ARRAYS: Final[Mapping[str, tuple[type, tuple[int, ...]]]] = {
    "sphere_centers_m": (np.float64, (3,)),
    "sphere_radii_m": (np.float64, ()),
    "sphere_object": (np.int64, ()),
    "box_centers_m": (np.float64, (3,)),
    "box_rotations": (np.float64, (3, 3)),
    "box_half_sizes_m": (np.float64, (3,)),
    "box_object": (np.int64, ()),
    "tetrahedron_vertices_m": (np.float64, (4, 3)),
    "tetrahedron_object": (np.int64, ()),
    "half_space_normals": (np.float64, (3,)),
    "half_space_offsets_m": (np.float64, ()),
    "half_space_object": (np.int64, ()),
    "mesh_index": (np.int64, ()),
    "mesh_positions_m": (np.float64, (3,)),
    "mesh_rotations": (np.float64, (3, 3)),
    "mesh_object": (np.int64, ()),
    "velocities_m_s": (np.float64, (3,)),
}
"""The arrays of a frame in their order, with the kind of their values and the shape of a row."""
_ROLES: Final = tuple(Role)
_T = TypeVar("_T")


class _State(msgspec.Struct, array_like=True, frozen=True):
    time_s: float
    joint_positions_rad: bytes
    joint_velocities_rad_s: bytes
    finger_positions: bytes
    gripper_opening_m: float
    gripper_holding: bool


class _Frame(msgspec.Struct, array_like=True, frozen=True):
    time_s: float
    names: tuple[str, ...] | None
    """None: the same as before, and of the arrays only those that differ follow"""
    roles: bytes
    arrays: dict[str, bytes | tuple[bytes, bytes] | None]
    """Each of ARRAYS whole, or the numbers (u32) of the rows that differ and these rows; None for no such array"""


def pack_state(state: ArmState) -> bytes:
    """One state."""
    joints, velocities, fingers = state.joint_positions_rad, state.joint_velocities_rad_s, state.finger_positions
    arrays = joints.tobytes(), velocities.tobytes(), fingers.tobytes()
    return msgspec.msgpack.encode(_State(state.time_s, *arrays, state.gripper_opening_m, state.gripper_holding))


def unpack_state(content: bytes) -> ArmState:
    """One state; ValueError for what is none."""
    told = _decoded(content, _State)
    joints, velocities, fingers = (
        np.frombuffer(values, "<f8").copy()
        for values in (told.joint_positions_rad, told.joint_velocities_rad_s, told.finger_positions)
    )
    return ArmState(told.time_s, joints, velocities, fingers, told.gripper_opening_m, told.gripper_holding)


class FramePacker:
    """Frames as what is new in them: most objects stand still."""

    def __init__(self) -> None:
        self._last: PerceivedObjects | None = None

    def begin_anew(self) -> None:
        """Tell the next frame whole."""
        self._last = None

    def pack(self, frame: PerceivedObjects) -> bytes:
        """One frame."""
        last, self._last = self._last, frame
        told: dict[str, bytes | tuple[bytes, bytes] | None] = {}
        for name, (_, shape) in ARRAYS.items():
            values, before = getattr(frame, name), None if last is None else getattr(last, name)
            if values is None or before is None or values.shape != before.shape:
                told[name] = None if values is None else values.tobytes()
                continue
            # By their bits: NaN is no reason to differ, and the sign of a zero is one.
            bits, bits_before = (
                np.ascontiguousarray(array).view(np.int64).reshape(len(array), math.prod(shape))
                for array in (values, before)
            )
            changed = np.flatnonzero((bits != bits_before).any(axis=1)).astype("<u4")
            if 2 * len(changed) > len(values):
                told[name] = values.tobytes()
            elif len(changed):
                told[name] = changed.tobytes(), values[changed].tobytes()
        roles = bytes(_ROLES.index(role) for role in frame.roles)
        return msgspec.msgpack.encode(_Frame(frame.time_s, frame.names if last is None else None, roles, told))


class FrameUnpacker:
    """Frames from what is new in them."""

    def __init__(self, scene: PerceivedObjects) -> None:
        """scene: any frame of the same scene, for the shapes of meshes: they do not change and are not recorded."""
        self._scene = scene
        self._last: PerceivedObjects | None = None

    def unpack(self, content: bytes) -> PerceivedObjects:
        """One frame; ValueError for what is none, or for one that follows a gap."""
        told, last = _decoded(content, _Frame), self._last
        if told.names is None and last is None:
            raise ValueError("a frame that tells only what is new, without one before it")
        names = self._scene.names
        if told.names not in (names, None) or len(told.roles) != len(names):
            raise ValueError("a frame of other objects than the scene's")
        arrays: dict[str, Any] = {}
        for name, (kind, shape) in ARRAYS.items():
            part = told.arrays.get(name, ())
            if isinstance(part, bytes):
                arrays[name] = np.frombuffer(part, kind).reshape(-1, *shape).copy()
            elif part:
                rows, values = part
                arrays[name] = getattr(last, name).copy()
                arrays[name][np.frombuffer(rows, "<u4")] = np.frombuffer(values, kind).reshape(-1, *shape)
            else:
                arrays[name] = None if part is None else getattr(last, name)
        roles = tuple(_ROLES[role] for role in told.roles)
        self._last = PerceivedObjects(
            time_s=told.time_s, names=names, roles=roles, mesh_library=self._scene.mesh_library, **arrays
        )
        return self._last


def _decoded(content: bytes, kind: type[_T]) -> _T:
    try:
        return msgspec.msgpack.decode(content, type=kind)
    except msgspec.DecodeError as error:
        raise ValueError(str(error)) from None
