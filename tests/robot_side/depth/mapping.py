"""Maps of scenes that were looked at for a while."""

from collections.abc import Sequence

import numpy as np

from common.arrays import FloatArray
from robot_side.depth.boxes import Boxes
from robot_side.depth.depth_map import DepthMap, Integrated
from robot_side.depth.picture import CameraPose, OwnBody
from tests.robot_side.depth.ray_cast import Camera, Thing

FRAME_S = 1.0 / 30.0
NOBODY = OwnBody(np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty((0, 3, 3)), np.empty((0, 3)))


class Watching:
    """A camera that looks at things, and the map that it makes."""

    def __init__(self, depth_map: DepthMap, noise: np.random.Generator | None = None) -> None:
        self.map = depth_map
        self._noise = noise
        self.time_s = 0.0

    def look(
        self,
        camera: Camera,
        things: Sequence[Thing],
        frames: int = 1,
        body: OwnBody = NOBODY,
        believed: CameraPose | None = None,
    ) -> Integrated:
        """Take pictures, and return what the last one did. believed: pose that the map is told."""
        for _ in range(frames):
            picture = camera.picture(things, self.time_s, self._noise)
            found = self.map.integrate(picture, believed or camera.pose, body, camera.errors)
            self.time_s += FRAME_S
        return found


def fronts(boxes: Boxes) -> FloatArray:
    """Return the corners (n, 4, 3) of the boxes' fronts."""
    half, x, y, z = boxes.half_sizes_m, *boxes.rotations.transpose(2, 0, 1)
    middle = boxes.centers_m + z * half[:, 2:]
    signs = ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))
    return np.stack([middle + a * x * half[:, :1] + b * y * half[:, 1:2] for a, b in signs], axis=1)


def near(boxes: Boxes, point_m: Sequence[float], reach_m: float) -> int:
    """Return the number of boxes whose middle is within a distance of a point."""
    return int((np.linalg.norm(boxes.centers_m - np.array(point_m), axis=1) < reach_m).sum())
