"""Many perceived objects without physics, placed around the table, out of the gripper's reach."""

from dataclasses import replace
from typing import Any, Final

import numpy as np

from common.roles import Role
from robot_side.surroundings.movers import OF_OBJECTS, Movers
from robot_side.surroundings.perceived import KINDS, ObjectSource, PerceivedObjects, SomeObjects

MIDDLE_M: Final = (0.55, 0.0, 0.25)
"""Middle of the built-in table's objects, in metres."""
NEAREST_M, FARTHEST_M = 0.6, 3.0
_SIZES_M: Final = (0.005, 0.03)


def crowd(count: int, time_s: float, seed: int = 1) -> PerceivedObjects:
    """Return a frame of `count` random objects, each of one primitive, spread evenly over directions and distances."""
    generator = np.random.default_rng(seed)
    away = generator.normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1)[:, None]
    at = MIDDLE_M + generator.uniform(NEAREST_M, FARTHEST_M, count)[:, None] * away
    radii_m = generator.uniform(*_SIZES_M, count)
    spheres, boxes, tetrahedra = (np.arange(kind, count, 3) for kind in range(3))
    edge = 1.0 / np.sqrt(3.0)
    corners = edge * np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)])
    return PerceivedObjects(
        time_s=time_s,
        names=tuple(f"crowd {k}" for k in range(count)),
        roles=(Role.OBSTACLE,) * count,
        sphere_centers_m=at[spheres],
        sphere_radii_m=radii_m[spheres],
        sphere_object=spheres,
        box_centers_m=at[boxes],
        box_rotations=np.tile(np.eye(3), (len(boxes), 1, 1)),
        box_half_sizes_m=np.repeat(edge * radii_m[boxes, None], 3, axis=1),
        box_object=boxes,
        tetrahedron_vertices_m=at[tetrahedra, None] + radii_m[tetrahedra, None, None] * corners,
        tetrahedron_object=tetrahedra,
        half_space_normals=np.empty((0, 3)),
        half_space_offsets_m=np.empty(0),
        half_space_object=np.empty(0, dtype=np.int64),
    )


class CrowdedCamera:
    """ObjectSource that adds a crowd of objects at rest to those of a camera."""

    def __init__(self, camera: ObjectSource, count: int, *, only: bool = False) -> None:
        """only: leave out the camera's own objects."""
        self._camera, self._count, self._only = camera, count, only
        self._own: PerceivedObjects | None = None
        self._shown: PerceivedObjects | None = None
        self._own_movers: SomeObjects | None = None
        self._movers: Movers | None = None
        self._roles: tuple[tuple[Role, ...], tuple[Role, ...]] = ((), ())

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the camera's newest frame with the crowd; the identical frame until the camera has a newer one."""
        own = self._camera.perceive(now_s)
        if self._shown is None or own is not self._own:
            before, self._own = self._own, own
            self._shown = self._with_crowd(own, before)
        return self._shown

    def set_role(self, name: str, role: Role) -> None:
        """Set the role of one of the camera's own objects."""
        self._camera.set_role(name, role)

    def _with_crowd(self, own: PerceivedObjects, before: PerceivedObjects | None) -> PerceivedObjects:
        if self._only:
            return joined(_without_objects(own), crowd(self._count, own.time_s))
        if own.since is None:
            return joined(own, crowd(self._count, own.time_s))
        movers, numbers = own.since
        if self._movers is None or self._own_movers is not movers:
            # The last complete frame has a table, and its roles are known.
            shown = self._shown if before is movers.first else None
            first = shown or joined(movers.first, crowd(self._count, movers.first.time_s))
            self._own_movers, self._movers = movers, Movers(first, movers.things)
            self._roles = movers.first.roles, first.roles
        if self._roles[0] is not own.roles:
            self._roles = own.roles, own.roles + (Role.OBSTACLE,) * self._count
        return self._movers.frame(own.time_s, numbers, self._roles[1])


def joined(one: PerceivedObjects, other: PerceivedObjects) -> PerceivedObjects:
    """Return a frame with the objects of both, at the time of `one`, without speeds; only `one` may have meshes."""
    arrays: dict[str, Any] = {}
    for kind in KINDS:
        arrays[kind.owner] = np.concatenate([getattr(one, kind.owner), len(one.names) + getattr(other, kind.owner)])
        for name, *_ in kind.arrays:
            arrays[name] = np.concatenate([getattr(one, name), getattr(other, name)])
    unknown: dict[str, Any] = dict.fromkeys(OF_OBJECTS)
    return replace(one, names=one.names + other.names, roles=one.roles + other.roles, **(arrays | unknown))


def _without_objects(own: PerceivedObjects) -> PerceivedObjects:
    none: dict[str, Any] = dict.fromkeys(OF_OBJECTS)
    for kind in KINDS:
        none |= {name: getattr(own, name)[:0] for name in (kind.owner, *(array.name for array in kind.arrays))}
    return replace(own, names=(), roles=(), **none)
