"""Objects that are always there, whatever a camera sees: boxes to keep out of, and the sides of the workspace."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from common.roles import Role
from robot_side.surroundings.movers import OF_OBJECTS
from robot_side.surroundings.perceived import KINDS, ObjectSource, PerceivedObjects

Vector3 = tuple[float, float, float]
KEEP_OUT = "keep out "
"""First words of the names of boxes"""


class PlacedBox(Protocol):
    """Box in the world frame, such as `arm.bounds.KeepOut`."""

    @property
    def center_m(self) -> Vector3:
        """Centre"""
        ...

    @property
    def half_sizes_m(self) -> Vector3:
        """Half sizes"""
        ...

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """Rotation from the box's frame to the world's, w first"""
        ...


SIDES = tuple(f"workspace {sign}{axis}" for sign in "+-" for axis in "xyz")


def fixed_objects(workspace: tuple[Vector3, Vector3] | None, keep_out: Sequence[PlacedBox]) -> PerceivedObjects:
    """Return a frame with a box for each of `keep_out`, and a half-space beyond each side of the workspace.

    workspace: lower and upper corner in the world frame; None: no sides.
    """
    normals, offsets_m = np.empty((0, 3)), np.empty(0)
    if workspace is not None:
        # Solid where normal·x <= offset: beyond the upper sides, then beyond the lower ones.
        normals = np.concatenate([-np.eye(3), np.eye(3)])
        offsets_m = np.concatenate([-np.array(workspace[1]), np.array(workspace[0])])
    boxes, sides = len(keep_out), len(offsets_m)
    names = (*(f"{KEEP_OUT}{number}" for number in range(1, boxes + 1)), *SIDES[:sides])
    turned = [Rotation.from_quat(one.quaternion, scalar_first=True).as_matrix() for one in keep_out]
    centers_m = np.array([one.center_m for one in keep_out]).reshape(-1, 3)
    return PerceivedObjects(
        time_s=0.0,
        names=names,
        roles=(Role.OBSTACLE,) * len(names),
        sphere_centers_m=np.empty((0, 3)),
        sphere_radii_m=np.empty(0),
        sphere_object=np.empty(0, dtype=np.int64),
        box_centers_m=centers_m,
        box_rotations=np.array(turned).reshape(-1, 3, 3),
        box_half_sizes_m=np.array([one.half_sizes_m for one in keep_out]).reshape(-1, 3),
        box_object=np.arange(boxes, dtype=np.int64),
        tetrahedron_vertices_m=np.empty((0, 4, 3)),
        tetrahedron_object=np.empty(0, dtype=np.int64),
        half_space_normals=normals,
        half_space_offsets_m=offsets_m,
        half_space_object=np.arange(boxes, boxes + sides, dtype=np.int64),
        positions_m=np.concatenate([centers_m, normals * offsets_m[:, None]]),
        rotations=np.concatenate([np.array(turned).reshape(-1, 3, 3), np.tile(np.eye(3), (sides, 1, 1))]),
        velocities_m_s=np.zeros((len(names), 3)),
        sds_m=np.zeros(len(names)),
    )


def joined(frame: PerceivedObjects, fixed: PerceivedObjects) -> PerceivedObjects:
    """Return the frame with the fixed objects behind its own.

    A camera's object may have a fixed one's name; the fixed one is then told from it by an exclamation mark.
    """
    names = tuple(name if name not in frame.names else f"{name}!" for name in fixed.names)
    arrays: dict[str, Any] = {}
    for kind in KINDS:
        for name in kind.parts:
            arrays[name] = np.concatenate([getattr(frame, name), getattr(fixed, name)])
        arrays[kind.owner] = np.concatenate([getattr(frame, kind.owner), getattr(fixed, kind.owner) + len(frame.names)])
    count = len(frame.names)
    # What the frame does not know of its own objects stays unknown; fixed ones are known, and rest.
    known: dict[str, Any] = {
        name: None if getattr(frame, name) is None else np.concatenate([getattr(frame, name), getattr(fixed, name)])
        for name in ("positions_m", "rotations")
    }
    if frame.velocities_m_s is not None:
        rests = np.zeros((len(fixed.names), 3)) if fixed.velocities_m_s is None else fixed.velocities_m_s
        known["velocities_m_s"] = np.concatenate([frame.velocities_m_s, rests])
    sds_m = np.full(count, np.nan) if frame.sds_m is None else frame.sds_m
    return PerceivedObjects(
        time_s=frame.time_s,
        names=frame.names + names,
        roles=frame.roles + fixed.roles,
        mesh_library=frame.mesh_library or fixed.mesh_library,
        sds_m=np.concatenate([sds_m, np.zeros(len(fixed.names))]),
        unseen_m=frame.unseen_m,
        late_s=frame.late_s,
        **arrays,
        **known,
    )


def only(frame: PerceivedObjects, which: Sequence[int]) -> PerceivedObjects:
    """Return a complete frame of some objects, by their indices, in this order; without errors of their own."""
    keep, new = np.array(which, dtype=np.int64), np.full(len(frame.names), -1)
    new[keep] = np.arange(len(keep))
    arrays: dict[str, Any] = {
        name: None if (values := getattr(frame, name)) is None else values[keep] for name in OF_OBJECTS
    }
    for kind in KINDS:
        owners = new[getattr(frame, kind.owner)]
        arrays |= {name: getattr(frame, name)[owners >= 0] for name in (*kind.parts, kind.owner)}
        arrays[kind.owner] = owners[owners >= 0]
    names, roles = tuple(frame.names[index] for index in which), tuple(frame.roles[index] for index in which)
    return PerceivedObjects(time_s=frame.time_s, names=names, roles=roles, mesh_library=frame.mesh_library, **arrays)


def is_fixed(name: str) -> bool:
    """Return whether a fixed object may have the name: a target never has it."""
    return name.rstrip("!") in SIDES or name.startswith(KEEP_OUT)


class WithFixed:
    """Source of objects, with fixed objects in each of its frames."""

    def __init__(self, source: ObjectSource, fixed: PerceivedObjects) -> None:
        self._source, self._fixed = source, fixed
        self._frames: tuple[PerceivedObjects, PerceivedObjects] | None = None

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`: the same object until there is a newer one."""
        frame = self._source.perceive(now_s)
        if self._frames is None or self._frames[0] is not frame:
            self._frames = frame, joined(frame, self._fixed)
        return self._frames[1]

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of an object of the source from the next frame on; a fixed object keeps its own."""
        if not is_fixed(name):
            self._source.set_role(name, role)


def with_fixed(source: ObjectSource, fixed: PerceivedObjects) -> ObjectSource:
    """Return the source with the fixed objects; the source itself if there are none."""
    return WithFixed(source, fixed) if fixed.names else source
