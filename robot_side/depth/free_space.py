"""Space that has been seen, in coarse cells, and what around the gripper nobody has seen."""

from typing import Final

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.kernel import array_of, compiled, input_array, input_indices
from robot_side.depth.own_body import beyond_m
from robot_side.depth.picture import DepthArray, OwnBody
from robot_side.depth.settings import MapSettings
from robot_side.depth.view import LEAST, PICTURE, pixel_of, to_camera
from robot_side.surroundings.perceived import UnknownSpace

_CELL_M: Final = 0.04
_STEEP: Final = 0.99
"""Upward part of the direction ahead from which up says nothing"""


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

    def unknown(self, position_m: FloatArray, rotation: FloatArray, half_m: float, reach_m: float) -> UnknownSpace:
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

        return UnknownSpace(
            ahead=share(ahead, left, up),
            left=share(left, ahead, up),
            right=share(-left, ahead, up),
            up=share(up, ahead, left),
            down=share(-up, ahead, left),
        )

    def boxes_m(self, position_m: FloatArray, reach_m: float, surfaces_m: FloatArray, body: OwnBody) -> FloatArray:
        """Return boxes of the cells (u, 2, 3), lower and upper corners, near a point that nobody has seen.

        Cells beyond the region count as such. Those with points of surfaces (n, 3) are left out, as the surface is
        felt there; so are those about the `body`.
        """
        first = np.floor((position_m - reach_m - self._place[:3]) / _CELL_M)
        count = round(2.0 * reach_m / _CELL_M) + 1
        cells = np.indices((count,) * 3).reshape(3, -1).T
        middles_m: FloatArray = self._place[:3] + (first + cells + 0.5) * _CELL_M
        unseen = (self._has_seen(middles_m) == 0.0) & (beyond_m(middles_m, body) > _CELL_M)
        unseen = unseen.reshape((count,) * 3)
        on = np.floor((surfaces_m - self._place[:3]) / _CELL_M).astype(np.int64) - first.astype(np.int64)
        unseen[tuple(on[((on >= 0) & (on < count)).all(axis=1)].T)] = False
        return self._place[:3] + (first + _in_boxes(unseen)) * _CELL_M

    def _has_seen(self, points_m: FloatArray) -> FloatArray:
        cells = np.floor((points_m - self._place[:3]) / _CELL_M).astype(np.int64)
        inside = ((cells >= 0) & (cells < self._cells)).all(axis=1)
        found = np.zeros(len(points_m))
        found[inside] = self._seen[np.ravel_multi_index(tuple(cells[inside].T), tuple(self._cells))]
        return found


def _in_boxes(cells: BoolArray) -> IntArray:
    """Return boxes (u, 2, 3), first indices and those behind the last, which together are the cells (a, b, c)."""
    edges = np.diff(np.pad(cells, ((0, 0), (0, 0), (1, 1))).astype(np.int8), axis=2)
    low, high = np.argwhere(edges > 0), np.argwhere(edges < 0) + np.array([1, 1, 0])
    for axis in (1, 0):
        low, high = _joined(low, high, axis)
    return np.stack([low, high], axis=1)


def _joined(low: IntArray, high: IntArray, axis: int) -> tuple[IntArray, IntArray]:
    """Join boxes (u, 3) that continue each other along an axis."""
    across = np.delete(np.concatenate([low, high], axis=1), (axis, axis + 3), axis=1)
    order = np.lexsort((low[:, axis], *across.T))
    low, high, across = low[order], high[order], across[order]
    begins = np.ones(len(low), dtype=np.bool_)
    begins[1:] = (across[1:] != across[:-1]).any(axis=1) | (low[1:, axis] != high[:-1, axis])
    return low[begins], high[np.roll(begins, -1)]


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
