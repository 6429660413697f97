"""Messages between the robot side and the process that maps depth pictures.

robot side ── Setup, Joints, RoleOf, Forget ──▶ companion
robot side ◀── Ready, Surfaces, Note, Refusal ── companion
"""

from typing import Final

import msgspec
import numpy as np

from common.roles import Role
from common.sockets.door.messages import DoorSettings
from robot_side.depth.camera_settings import DepthCameraSettings, LinkMount
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import BOX_NUMBERS, SlotChanges
from robot_side.surroundings.perceived import UnknownSpace


class Loaded(msgspec.Struct, frozen=True):
    """Arguments with which the robot side loaded its scene."""

    model: str | None
    site: str | None
    roles: dict[str, Role]
    name: str
    seed: int
    site_axis: str


class Setup(msgspec.Struct, frozen=True, tag=True):
    """First message to the companion."""

    scene: Loaded
    camera: DepthCameraSettings
    mapped: MapSettings
    mounts: dict[str, LinkMount]
    encoder: tuple[float, float]
    """σ and resolution of the joints' readings"""
    port: DoorSettings | None
    """Port at which pictures arrive; None: cameras are simulated"""
    seed: int


class Joints(msgspec.Struct, frozen=True, tag=True):
    """Where the robot was; from a simulation, where everything was."""

    time_s: float
    """Time of the measurement, on the monotonic clock that both processes read"""
    arm: bytes
    """(n,) float64: readings of the arm's joints"""
    fingers: bytes
    """(f,) float64: readings of the gripper's joints"""
    held: bytes
    """(k, 4) float64: spheres of what the gripper holds, in the tool's frame; centres and radii"""
    models: bytes | None = None
    """(k, 16) float64: solids of known models (`OwnBody`); None: as they were"""
    positions: bytes = b""
    """MuJoCo's qpos, as float64; empty if nothing is simulated"""


class RoleOf(msgspec.Struct, frozen=True, tag=True):
    """New role of an object, by the name that it has at the robot side."""

    name: str
    role: Role


class Forget(msgspec.Struct, frozen=True, tag=True):
    """What was seen is to be forgotten, as the objects were put back."""


class Ready(msgspec.Struct, frozen=True, tag=True):
    """Answer to Setup: from now on pictures are taken."""

    endpoint: str
    """Address of the port; empty if cameras are simulated"""


class Surfaces(msgspec.Struct, frozen=True, tag=True):
    """Surfaces that have changed (see `SlotChanges`), and what the pictures were like."""

    taken_s: tuple[float, float]
    """Earliest and latest time at which the newest picture was taken"""
    slots: bytes
    numbers: bytes
    roles: bytes
    sds_m: bytes
    velocities_m_s: bytes
    planes: bytes
    crowded_out: int
    moved_s: float
    seen: dict[str, float]
    """Figures of the pictures since the last message, and of the map"""
    unknown: tuple[float, float, float, float, float]
    unknown_boxes: bytes
    """(u, 2, 3) float64; both as in `UnknownSpace`"""


def surfaces(
    changes: SlotChanges, taken_s: tuple[float, float], seen: dict[str, float], unknown: UnknownSpace
) -> Surfaces:
    """Return the message of these changes; arguments as the message's fields."""
    return Surfaces(
        taken_s=taken_s,
        slots=changes.slots.tobytes(),
        numbers=changes.numbers.tobytes(),
        roles=changes.roles.tobytes(),
        sds_m=changes.sds_m.tobytes(),
        velocities_m_s=changes.velocities_m_s.tobytes(),
        planes=changes.planes.tobytes(),
        crowded_out=changes.crowded_out,
        moved_s=changes.moved_s,
        seen=seen,
        unknown=unknown.shares,
        unknown_boxes=unknown.boxes_m.tobytes(),
    )


def changes_of(message: Surfaces) -> SlotChanges:
    """Return the changes of a message."""
    return SlotChanges(
        np.frombuffer(message.slots, dtype=np.int64),
        np.frombuffer(message.numbers).reshape(-1, BOX_NUMBERS),
        np.frombuffer(message.roles, dtype=np.int64),
        np.frombuffer(message.sds_m),
        np.frombuffer(message.velocities_m_s).reshape(-1, 3),
        np.frombuffer(message.planes, dtype=np.int64),
        message.crowded_out,
        message.moved_s,
    )


def unknown_of(message: Surfaces) -> UnknownSpace:
    """Return the unknown space of a message."""
    return UnknownSpace(*message.unknown, np.frombuffer(message.unknown_boxes).reshape(-1, 2, 3))


class Note(msgspec.Struct, frozen=True, tag=True):
    """Line for a person."""

    text: str


class Refusal(msgspec.Struct, frozen=True, tag=True):
    """Nothing can be seen: the reason, and what to do about it."""

    reason: str


encode: Final = msgspec.msgpack.Encoder().encode
decode_to_companion: Final = msgspec.msgpack.Decoder(Setup | Joints | RoleOf | Forget).decode
decode_from_companion: Final = msgspec.msgpack.Decoder(Ready | Surfaces | Note | Refusal).decode
