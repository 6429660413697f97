"""Surfels of what moves: they move with it from picture to picture, so that no means smear it, and nothing trails."""

from typing import Final

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import array_of, compiled, input_array, input_indices, output_indices
from robot_side.compiled.vectors import add, scale
from robot_side.depth.boxes import Boxes
from robot_side.depth.grid import block_of
from robot_side.depth.motion.regions import LABELS, LabelsArray
from robot_side.depth.motion.seer import UNSEEN_S, Mover
from robot_side.depth.motion.snapshots import Snapshot
from robot_side.depth.surfel_map.merging import DIRTY
from robot_side.depth.surfel_map.surfel_columns import Count, surfels_at
from robot_side.depth.surfel_map.surfels import SurfelMap
from robot_side.depth.together import planes_of
from robot_side.depth.view import pixel_of, sd_at, to_camera

_FILLED: Final = 0.3
"""Share of a box's cells that must have surfels of a mover"""
_SLOPE: Final = 0.02
"""Share of the depth by which a surfel may differ from its pixel, beyond its errors"""
_MOST_WEIGHT: Final = 2.0
"""Number of pictures that the mean of a moving surfel is worth at most"""


class Carried:
    """Surfels of a map that move."""

    def __init__(self, surfels: SurfelMap) -> None:
        self._surfels = surfels
        self._movers = np.zeros(len(surfels.table.cells), dtype=np.int64)
        """(n,) identity of the mover of which each surfel is a part; 0: none"""
        self._cells = np.full(len(surfels.table.cells), -1)
        """(n,) cell of each surfel when it became one: rows are used again"""
        self._time_s = -np.inf

    def _rows(self, identities: IntArray) -> IntArray:
        table = self._surfels.table
        rows = np.flatnonzero(self._movers)
        gone = (self._cells[rows] != table.cells[rows]) | ~np.isin(self._movers[rows], identities)
        self._movers[rows[gone]] = 0
        kept: IntArray = rows[~gone]
        return kept

    def move(self, now_s: float, movers: dict[int, Mover]) -> None:
        """Let the surfels be where they are at `now_s`."""
        elapsed_s, self._time_s = min(now_s - self._time_s, UNSEEN_S), max(now_s, self._time_s)
        rows = self._rows(np.array(list(movers), dtype=np.int64))
        if not rows.size or elapsed_s <= 0.0:
            return
        surfels, table, grid = self._surfels, self._surfels.table, self._surfels.grid
        surfels.look_again(rows[table.shown[rows] > 0])
        table.points_m[rows] += elapsed_s * np.array([movers[one].velocity_m_s for one in self._movers[rows].tolist()])
        places = np.floor((table.points_m[rows] - grid.place[:3]) * grid.place[4]).astype(np.int64)
        inside = ((places >= 0) & (places < grid.cells)).all(axis=1)
        cells = (places[:, 0] * grid.cells[1] + places[:, 1]) * grid.cells[2] + places[:, 2]
        surfels.slot[table.cells[rows]] = -1
        # Where two surfels meet, one stays.
        stay: BoolArray = np.zeros(len(rows), dtype=np.bool_)
        stay[np.unique(np.where(inside, cells, -1), return_index=True)[1]] = True
        stay[inside] &= surfels.slot[cells[inside]] < 0
        stay &= inside
        kept, cells = rows[stay], cells[stay]
        table.cells[kept] = self._cells[kept] = cells
        surfels.slot[cells] = kept
        surfels.look_again(kept[table.shown[kept] > 0])
        surfels.free(rows[~stay])

    def mark(self, newest: Snapshot, members: LabelsArray, camera_movers: IntArray) -> None:
        """Take the surfels that the newest picture shows within what moves; let go of those beside it.

        members: as of `MotionSeer.see`. camera_movers: what moves in this camera's pictures.
        """
        surfels = self._surfels
        view, bundle, counts = newest.view, surfels.bundle, surfels.counts
        _mark(
            *(newest.depth_m, view, members, surfels.grid.place, camera_movers, bundle, counts),
            *(self._movers, self._cells, surfels.grid.cells, surfels.dirty),
        )

    def velocities(self, boxes: Boxes, movers: dict[int, Mover]) -> FloatArray:
        """Return the velocity (n, 3) of each box. Pieces of one plane move together, if the greater part does."""
        found = np.zeros((len(boxes.ids), 3))
        rows = self._rows(np.array([one for one, mover in movers.items() if mover.counts], dtype=np.int64))
        if not rows.size or not len(found):
            return found
        points_m, edge_m = self._surfels.table.points_m[rows], self._surfels.grid.place[3]
        margin_m = np.linalg.norm(boxes.half_sizes_m, axis=1) + edge_m
        low_m, high_m = points_m.min(axis=0), points_m.max(axis=0)
        near = np.flatnonzero(
            ((boxes.centers_m >= low_m - margin_m[:, None]) & (boxes.centers_m <= high_m + margin_m[:, None])).all(
                axis=1
            )
        )
        areas = np.maximum(4.0 * boxes.half_sizes_m[:, :2].prod(axis=1) / edge_m**2, 1.0)
        for box in near.tolist():
            local_m = (points_m - boxes.centers_m[box]) @ boxes.rotations[box]
            inside = (np.abs(local_m) <= boxes.half_sizes_m[box] + 0.5 * edge_m).all(axis=1)
            if np.count_nonzero(inside) >= _FILLED * areas[box]:
                named, counts = np.unique(self._movers[rows[inside]], return_counts=True)
                found[box] = movers[int(named[counts.argmax()])].velocity_m_s
        return _together(found, planes_of(boxes), areas)


def _together(velocities_m_s: FloatArray, planes: IntArray, areas: FloatArray) -> FloatArray:
    """Return the mean velocity of each plane's boxes that move; 0 if these are the smaller part."""
    moving = np.bincount(planes, areas * velocities_m_s.any(axis=1))
    sums = np.stack([np.bincount(planes, areas * one) for one in velocities_m_s.T], axis=1)
    means = sums / np.maximum(moving, 1e-12)[:, None]
    means[moving < 0.5 * np.bincount(planes, areas)] = 0.0
    together: FloatArray = means[planes]
    return together


@compiled(
    *(array_of(np.float32, 2, read_only=True), input_array(1), LABELS, input_array(1), input_indices(), BUNDLE),
    *(output_indices(), output_indices(), output_indices(), input_indices(), DIRTY),
)
def _mark(
    depth_m: np.ndarray,
    view: FloatArray,
    members: LabelsArray,
    place: FloatArray,
    camera_movers: IntArray,
    bundle: IntArray,
    counts: IntArray,
    movers: IntArray,
    cells: IntArray,
    all_cells: IntArray,
    dirty: np.ndarray,
) -> None:
    surfels = surfels_at(bundle)
    for t in range(counts[Count.TOUCHED]):
        row = surfels.touched[t]
        sums, by = surfels.sums, 1.0 / surfels.sums[row, 0]
        point = add((place[0], place[1], place[2]), scale(by, (sums[row, 1], sums[row, 2], sums[row, 3])))
        a = to_camera(view, point)
        if a[2] <= 0.0:
            continue
        i, j = pixel_of(view, a)
        if i < 0 or j < 0 or i >= depth_m.shape[0] or j >= depth_m.shape[1]:
            continue
        if abs(a[2] - depth_m[i, j]) > 3.0 * sd_at(view, a[2]) + _SLOPE * a[2]:
            # Beside an edge the pixel shows something else.
            continue
        if members[i, j] > 0:
            if movers[row] == 0:
                # The means of earlier pictures are of where it was.
                for k in range(3):
                    surfels.points_m[row, k] = point[k]
                dirty[block_of(all_cells, surfels.cells[row])] = 1
            movers[row], cells[row] = members[i, j], surfels.cells[row]
            # What moves is shown at once.
            if not surfels.shown[row]:
                surfels.shown[row] = dirty[block_of(all_cells, surfels.cells[row])] = 1
            surfels.evidence[row] = 1
            surfels.weights[row] = min(surfels.weights[row], _MOST_WEIGHT)
        elif movers[row] > 0:
            for one in range(camera_movers.size):
                if camera_movers[one] == movers[row]:
                    movers[row] = 0
