"""Surfaces that depth cameras see, for drawing: those of a fixed pool that are used."""

import numpy as np
from scipy.spatial.transform import Rotation

from common.roles import ROLES
from robot_side.drivers.mujoco.scene import Scene
from robot_side.surroundings.fixed_objects import only
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.viewing.perceived_shapes import PerceivedModel

_SPECK_M = 0.001
"""Half size up to which a box is a piece of the target that is not in use"""
_PARKED_BELOW_M = -100.0
"""Height below which no surface is: unused ones are parked there"""


class SurfaceModel(PerceivedModel):
    """Links of a scene's robot, surfaces, and the objects behind these: fixed ones, and known models."""

    def __init__(self, scene: Scene, fixed: PerceivedObjects, surfaces: int) -> None:
        """surfaces: number of objects of the pool. fixed: objects behind these, until a frame has others."""
        super().__init__(scene)
        self.surfaces, self._names = surfaces, fixed.names
        super().update(fixed)

    def update(self, objects: PerceivedObjects) -> bool:
        """Return whether a frame has other objects behind the surfaces than the last one."""
        names = objects.names[self.surfaces :]
        if names == self._names:
            return False
        self._names = names
        return super().update(only(objects, range(self.surfaces, len(objects.names))))


def seen_surfaces(objects: PerceivedObjects, count: int) -> tuple[bytes, bytes]:
    """Return the boxes of the first `count` objects of a frame, and their roles, as SceneState has them."""
    seen = (objects.box_centers_m[:, 2] > _PARKED_BELOW_M) & (objects.box_object < count)
    used = np.flatnonzero(seen & (objects.box_half_sizes_m.max(axis=1) > _SPECK_M))
    if not used.size:
        return b"", b""
    turned = Rotation.from_matrix(objects.box_rotations[used]).as_quat(scalar_first=True)
    rows = np.concatenate([objects.box_centers_m[used], turned, objects.box_half_sizes_m[used]], axis=1)
    return rows.astype("<f4").tobytes(), bytes(
        ROLES.index(objects.roles[index]) for index in objects.box_object[used].tolist()
    )
