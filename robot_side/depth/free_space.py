"""Space that has been seen, in coarse cells, and the share around the gripper that nobody has seen."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import array_of, compiled, input_array, input_indices
from robot_side.depth.picture import DepthArray
from robot_side.depth.settings import MapSettings
from robot_side.depth.view import LEAST, PICTURE, pixel_of, to_camera

_CELL_M: Final = 0.04
_STEEP: Final = 0.99
"""Upward part of the direction ahead from which up says nothing"""


@dataclass(frozen=True)
class Unknown:
    """Share of the space beside the gripper that has never been seen, by direction: 0 to 1."""

    ahead: float
    left: float
    right: float
    up: float
    down: float


class SeenSpace:
    """Space of a region that some camera has seen, by the middles of coarse cells."""

    def __init__(self, settings: MapSettings) -> None:
        lower, upper = np.array(settings.lower_m), np.array(settings.upper_m)
        self._place: FloatArray = np.array([*lower, _CELL_M])
        self._cells: IntArray = np.ceil((upper - lower) / _CELL_M - 1e-9).astype(np.int64)
        self._seen = np.zeros(int(self._cells.prod()), dtype=np.uint8)

    def see(self, depth_m: DepthArray, view: FloatArray) -> None:
        """Note what a picture shows: all space up to what it measures."""
        _mark_seen(depth_m, view, self._place, self._cells, self._seen)

    def unknown(self, position_m: FloatArray, rotation: FloatArray, half_m: float, reach_m: float) -> Unknown:
        """Return which share of the space around the gripper nobody has seen; all beyond the region counts as such.

        rotation (3, 3): of the gripper, which advances along its z. Each direction has a box that begins half_m from
        `position_m`, ends at reach_m, and is 2 half_m wide. Up is the world's, or the gripper's x if ahead is vertical.
        """
        ahead = rotation[:, 2]
        up = np.array([0.0, 0.0, 1.0]) if abs(ahead[2]) < _STEEP else rotation[:, 0]
        up = up - (up @ ahead) * ahead
        up /= np.linalg.norm(up)
        left = np.cross(up, ahead)
        across = np.linspace(-half_m, half_m, max(2, round(2.0 * half_m / _CELL_M)))
        along = np.linspace(half_m, reach_m, max(2, round((reach_m - half_m) / _CELL_M)))
        steps = np.stack(np.meshgrid(along, across, across, indexing="ij"), axis=-1).reshape(-1, 3)

        def share(main: FloatArray, side: FloatArray, other: FloatArray) -> float:
            return 1.0 - float(self._has_seen(position_m + steps @ np.stack([main, side, other])).mean())

        return Unknown(
            ahead=share(ahead, left, up),
            left=share(left, ahead, up),
            right=share(-left, ahead, up),
            up=share(up, ahead, left),
            down=share(-up, ahead, left),
        )

    def _has_seen(self, points_m: FloatArray) -> FloatArray:
        cells = np.floor((points_m - self._place[:3]) / _CELL_M).astype(np.int64)
        inside = ((cells >= 0) & (cells < self._cells)).all(axis=1)
        found = np.zeros(len(points_m))
        found[inside] = self._seen[np.ravel_multi_index(tuple(cells[inside].T), tuple(self._cells))]
        return found


@compiled(PICTURE, input_array(1), input_array(1), input_indices(), array_of(np.uint8, 1))
def _mark_seen(depth_m: DepthArray, view: FloatArray, place: FloatArray, cells: IntArray, seen: np.ndarray) -> None:
    height, width = depth_m.shape
    edge = place[3]
    for a in range(cells[0]):
        for b in range(cells[1]):
            row = (a * cells[1] + b) * cells[2]
            for c in range(cells[2]):
                if seen[row + c]:
                    continue
                point = to_camera(
                    view, (place[0] + (a + 0.5) * edge, place[1] + (b + 0.5) * edge, place[2] + (c + 0.5) * edge)
                )
                if point[2] < view[LEAST]:
                    continue
                i, j = pixel_of(view, point)
                if 0 <= i < height and 0 <= j < width and point[2] < depth_m[i, j] + 0.5 * edge:
                    seen[row + c] = 1
