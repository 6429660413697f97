"""Few large boxes behind the surfaces. Only blocks of cells whose surfels have changed are looked at again."""

from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import INT64, building_block, compiled, input_array, input_indices, output_indices
from robot_side.depth.boxes import Boxes
from robot_side.depth.grid import LEVELS, Grid
from robot_side.depth.octree.coplanar import absorb, merge_coplanar
from robot_side.depth.octree.keeping import keep_or_write
from robot_side.depth.octree.partition import NODES, divide
from robot_side.depth.octree.patch_columns import (
    BOXES,
    PATCHES,
    BoxColumns,
    BoxCount,
    PatchColumns,
    box_columns,
    boxes_at,
    patch_columns,
    patches_at,
)
from robot_side.depth.surfel_map.collecting import SLOTS
from robot_side.depth.surfel_map.merging import DIRTY
from robot_side.depth.surfel_map.surfel_columns import SurfelColumns, surfels_at
from robot_side.depth.surfel_map.surfels import SurfelMap

_SIDE: Final = 1 << LEVELS
_ROOM: Final = 50_000
"""Largest number of boxes"""


class Planes:
    """Boxes behind a map's surfels."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        blocks = int(grid.blocks.prod())
        self._boxes: BoxColumns = box_columns(_ROOM)
        self._patches: PatchColumns = patch_columns(_SIDE**3 + 1)
        self._box_bundle, self._patch_bundle = BOXES.bundle(self._boxes), PATCHES.bundle(self._patches)
        self._first_box = np.full(blocks, -1, dtype=np.int32)
        self._box_of = np.full(blocks * NODES, -1, dtype=np.int32)
        self._was_patch = np.zeros(blocks * NODES, dtype=np.uint8)
        self._into = np.full(blocks * NODES, -1, dtype=np.int32)
        self._members = np.zeros((2, _SIDE**3), dtype=np.int64)
        self._counts = np.zeros(len(BoxCount), dtype=np.int64)

    def follow(self, surfels: SurfelMap) -> int:
        """Look again at the marked blocks, and unmark them; return how many boxes are new, gone or elsewhere."""
        self._counts[BoxCount.CHANGED] = 0
        for block in np.flatnonzero(surfels.dirty):
            _look_again(
                block,
                surfels.bundle,
                surfels.slot,
                self._grid.place,
                self._grid.cells,
                self._patch_bundle,
                self._box_bundle,
                self._first_box,
                self._box_of,
                self._was_patch,
                self._into,
                *self._members,
                self._counts,
            )
        surfels.dirty[:] = 0
        return int(self._counts[BoxCount.CHANGED])

    @property
    def count(self) -> int:
        """Number of boxes"""
        return int(self._counts[BoxCount.TOP] - self._counts[BoxCount.FREE])

    def boxes(self) -> Boxes:
        """Return all boxes."""
        table = self._boxes
        rows = np.flatnonzero(table.nodes[: self._counts[BoxCount.TOP]] >= 0)
        rows = rows[np.argsort(table.nodes[rows])]
        axes = table.axes[rows].reshape(-1, 3, 3)
        return Boxes(
            ids=table.nodes[rows],
            centers_m=table.centers_m[rows],
            rotations=np.ascontiguousarray(axes.transpose(0, 2, 1)),
            half_sizes_m=table.halves_m[rows],
            roles=table.roles[rows],
            sds_m=table.sds_m[rows],
        )


@building_block
def _let_go(
    patches: PatchColumns, count: int, boxes: BoxColumns, box_of: np.ndarray, nodes: int, first: int, counts: IntArray
) -> None:
    """Free the boxes of a block, of which `first` is the first, whose nodes are no patches any more."""
    row = first
    while row >= 0:
        boxes.found[row] = 0
        row = boxes.following[row]
    for patch in range(count):
        if patches.nodes[patch] >= 0 and box_of[nodes + patches.nodes[patch]] >= 0:
            boxes.found[box_of[nodes + patches.nodes[patch]]] = 1
    row = first
    while row >= 0:
        if boxes.found[row] == 0:
            box_of[boxes.nodes[row]] = -1
            boxes.nodes[row] = -1
            boxes.free[counts[BoxCount.FREE]] = row
            counts[BoxCount.FREE] += 1
            counts[BoxCount.CHANGED] += 1
        row = boxes.following[row]


@building_block
def _gather(surfels: SurfelColumns, slot: np.ndarray, cells: IntArray, block: int, members: IntArray) -> int:
    """Write the rows of a block's shown surfels into `members`, and note where they are; return their number."""
    across, up = ((cells[1] - 1) >> LEVELS) + 1, ((cells[2] - 1) >> LEVELS) + 1
    a, b, c = block // (across * up) * _SIDE, block // up % across * _SIDE, block % up * _SIDE
    count = 0
    for i in range(a, min(a + _SIDE, cells[0])):
        for j in range(b, min(b + _SIDE, cells[1])):
            for k in range(c, min(c + _SIDE, cells[2])):
                row = slot[(i * cells[1] + j) * cells[2] + k]
                if row >= 0 and surfels.shown[row]:
                    members[count] = row
                    count += 1
                    for axis in range(3):
                        surfels.looked_m[row, axis] = surfels.points_m[row, axis]
                    surfels.looked_m[row, 3] = surfels.sds_m[row]
    return count


@compiled(
    *(INT64, BUNDLE, SLOTS, input_array(1), input_indices(), BUNDLE, BUNDLE, SLOTS, SLOTS, DIRTY, SLOTS),
    *(output_indices(), output_indices(), output_indices()),
)
def _look_again(
    block: int,
    surfel_bundle: IntArray,
    slot: np.ndarray,
    place: FloatArray,
    cells: IntArray,
    patch_bundle: IntArray,
    box_bundle: IntArray,
    first_box: np.ndarray,
    box_of: np.ndarray,
    was_patch: np.ndarray,
    into: np.ndarray,
    members: IntArray,
    spare: IntArray,
    counts: IntArray,
) -> None:
    """Divide a block's surfels into patches, and let its boxes follow them."""
    surfels, patches, boxes = surfels_at(surfel_bundle), patches_at(patch_bundle), boxes_at(box_bundle)
    count = _gather(surfels, slot, cells, block, members)
    found = 0
    if count > 0:
        found = divide(surfels, cells, members, spare, count, patches, place[3], was_patch, block * NODES)
        merge_coplanar(patches, found, place[3], into, block * NODES)
        absorb(patches, found, place[3], into, block * NODES)
    _let_go(patches, found, boxes, box_of, block * NODES, first_box[block], counts)
    first_box[block] = -1
    for patch in range(found):
        if patches.nodes[patch] >= 0:
            row = keep_or_write(patches, patch, boxes, box_of, block * NODES + patches.nodes[patch], place[3], counts)
            if row >= 0:
                boxes.following[row] = first_box[block]
                first_box[block] = row
