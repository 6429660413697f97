"""Surfaces that depth cameras see, for drawing: those of a fixed pool that are used."""

import numpy as np
from scipy.spatial.transform import Rotation

from common.roles import ROLES
from robot_side.drivers.mujoco.scene import Scene
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.viewing.shapes import SceneModel

_PARKED_BELOW_M = -100.0
"""Height below which no surface is: unused ones are parked there"""


class SurfaceModel(SceneModel):
    """Links of a scene's robot, surfaces, and the fixed objects behind these."""

    def __init__(self, scene: Scene, fixed: PerceivedObjects, surfaces: int) -> None:
        """surfaces: number of slots. fixed: as for SceneModel."""
        super().__init__(scene, fixed)
        self.surfaces, self.objects, self._geoms = surfaces, fixed.names, []
        self.may_move = np.arange(len(fixed.names))


def seen_surfaces(objects: PerceivedObjects, slots: int) -> tuple[bytes, bytes]:
    """Return the surfaces among the first `slots` objects of a frame, and their roles, as SceneState has them."""
    used = np.flatnonzero(objects.box_centers_m[:slots, 2] > _PARKED_BELOW_M)
    if not used.size:
        return b"", b""
    turned = Rotation.from_matrix(objects.box_rotations[used]).as_quat(scalar_first=True)
    rows = np.concatenate([objects.box_centers_m[used], turned, objects.box_half_sizes_m[used]], axis=1)
    return rows.astype("<f4").tobytes(), bytes(ROLES.index(objects.roles[index]) for index in used.tolist())
