"""Map of surfels: mean points of surfaces in the cells of a region, and what speaks for each."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import ROLES
from robot_side.depth.grid import LEVELS, Grid
from robot_side.depth.picture import DepthArray, DepthPicture, LabelArray
from robot_side.depth.surfel_map.collecting import collect
from robot_side.depth.surfel_map.folding import fold_layers
from robot_side.depth.surfel_map.merging import merge
from robot_side.depth.surfel_map.surfel_columns import SURFELS, Count, SurfelColumns, surfel_columns
from robot_side.depth.surfel_map.unseen import look_for_unseen

_ROOM: Final = 200_000
"""Largest number of surfels"""
_LONGEST_S: Final = 0.2
"""Most of the time between two pictures that counts as time without an answer"""
_LEAST_ANSWERS: Final = 0.002
"""Least share of a picture's pixels with depth, for time without an answer to count"""
_NO_LABELS: Final = np.zeros((1, 1), dtype=np.uint8)


@dataclass(frozen=True)
class Merged:
    """What became of surfels with one picture."""

    made: int
    """Cells with points for the first time"""
    contradicted: int
    """Gone, as something is measured behind them"""
    unanswered: int
    """Gone, as they were in view without an answer for too long"""
    without_room: int
    """Pixels for which there was no room"""


class SurfelMap:
    """Surfels in a fixed region."""

    def __init__(self, grid: Grid, room: int = _ROOM) -> None:
        """room: largest number of surfels."""
        self.grid = grid
        self.table: SurfelColumns = surfel_columns(room)
        self.bundle: IntArray = SURFELS.bundle(self.table)
        self.slot = np.full(int(grid.cells.prod()), -1, dtype=np.int32)
        """(c,) row of each cell's surfel; -1: none"""
        self.dirty = np.zeros(int(grid.blocks.prod()), dtype=np.uint8)
        """(b,) 1 for blocks whose surfels have changed since surfaces were last looked for"""
        self.counts = np.zeros(len(Count), dtype=np.int64)
        """(c,) counts by `Count`"""
        self._taken_s: dict[int, float] = {}

    def integrate(
        self,
        picture: DepthPicture,
        depth_m: DepthArray,
        normals: DepthArray,
        own: LabelArray,
        view: FloatArray,
        camera: int = 0,
    ) -> Merged:
        """Add a picture. depth_m (h, w): with support; normals (h, w, 3); own (h, w): 1 for the robot's own pixels."""
        roles = np.full(256, -1)
        for label, role in picture.roles.items():
            roles[label] = ROLES.index(role)
        labels = _NO_LABELS if picture.labels is None else np.ascontiguousarray(picture.labels)
        place, cells, counts = self.grid.place, self.grid.cells, self.counts
        counts[[Count.MADE, Count.FULL]] = 0
        collect(depth_m, own, labels, roles, normals, view, place, cells, self.slot, self.bundle, counts)
        fold_layers(view, place, cells, self.slot, self.bundle, counts)
        merge(view, picture.labels is not None, place, cells, self.bundle, counts, self.dirty)
        elapsed_s = picture.taken_s - self._taken_s.get(camera, picture.taken_s)
        self._taken_s[camera] = picture.taken_s
        elapsed_s = min(max(elapsed_s, 0.0), _LONGEST_S) / len(self._taken_s)
        if np.count_nonzero(depth_m) < _LEAST_ANSWERS * depth_m.size:
            # A covered lens says nothing about what was there.
            elapsed_s = 0.0
        look_for_unseen(depth_m, own, view, elapsed_s, place, cells, self.slot, self.bundle, counts, self.dirty)
        found = (int(counts[kind]) for kind in (Count.MADE, Count.CONTRADICTED, Count.UNANSWERED, Count.FULL))
        return Merged(*found)

    @property
    def shown(self) -> IntArray:
        """Rows of the surfels that have been in two pictures"""
        top = int(self.counts[Count.TOP])
        return np.flatnonzero((self.table.cells[:top] >= 0) & (self.table.shown[:top] > 0))

    def forget(self, rows: IntArray) -> None:
        """Remove these surfels (n,)."""
        self.look_again(rows)
        self.slot[self.table.cells[rows]] = -1
        self.free(rows)

    def free(self, rows: IntArray) -> None:
        """Let these surfels (n,) be gone, which hold no cell any more."""
        count = int(self.counts[Count.FREE])
        self.table.cells[rows] = -1
        self.table.free[count : count + len(rows)] = rows
        self.counts[Count.FREE] += len(rows)

    def look_again(self, rows: IntArray) -> None:
        """Let surfaces be looked for again where these surfels (n,) are."""
        cells, (_, across, up) = self.grid.cells, self.grid.blocks
        of = self.table.cells[rows]
        i, j, k = of // (cells[1] * cells[2]), of // cells[2] % cells[1], of % cells[2]
        self.dirty[((i >> LEVELS) * across + (j >> LEVELS)) * up + (k >> LEVELS)] = 1
