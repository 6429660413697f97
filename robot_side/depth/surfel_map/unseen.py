"""What becomes of surfels that a picture does not show. Three kinds of unseen are kept apart.

Contradicted: something is measured behind it. In view without an answer: nothing is measured where it should be. Out of
view, too near or hidden: it is kept, as time alone says nothing. Else the wall just ahead of a wrist camera would go.
"""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import FLOAT64, building_block, compiled, input_array, input_indices, output_indices
from robot_side.compiled.vectors import load
from robot_side.depth.grid import block_of
from robot_side.depth.picture import DepthArray, LabelArray
from robot_side.depth.surfel_map.collecting import SLOTS
from robot_side.depth.surfel_map.merging import DIRTY
from robot_side.depth.surfel_map.surfel_columns import Count, surfels_at
from robot_side.depth.view import LEAST, MASK, MOST, PICTURE, pixel_of, pixels_across, sd_at, to_camera

_SIGMAS: Final = 3.0
_UNCONFIRMED: Final = 90
"""Pictures, of all cameras, after which a surfel that only one of them showed is forgotten"""
_UNANSWERED_S: Final = 1.9
"""Time in view without an answer after which a surfel is gone: with the next picture, within 2 s"""
_MOST_HOLES: Final = 4
"""Pixels without depth, of nine, with which a place still has an answer"""
_HIDDEN: Final = 4.0
"""Standard deviations behind what is measured from which a surfel is hidden"""
_FINE: Final = 1.2
"""Pixels across a cell from which on each surfel in view should have some"""
_NEAR: Final = 1.1
"""Factor on the least range within which a surface may already be too near"""


@building_block
def _window(depth_m: DepthArray, own: LabelArray, row: int, column: int) -> tuple[float, int]:
    """Return the least depth in a window of nine pixels, and how many have none; -1 if it shows the robot."""
    least, holes = math.inf, 0
    for i in range(row - 1, row + 2):
        for j in range(column - 1, column + 2):
            if own[i, j]:
                return 0.0, -1
            if depth_m[i, j] <= 0.0:
                holes += 1
            else:
                least = min(least, 1.0 * depth_m[i, j])
    return least, holes


@compiled(
    *(PICTURE, MASK, input_array(1), FLOAT64, input_array(1), input_indices(), SLOTS, BUNDLE, output_indices(), DIRTY),
)
def look_for_unseen(
    depth_m: DepthArray,
    own: LabelArray,
    view: FloatArray,
    elapsed_s: float,
    place: FloatArray,
    cells: IntArray,
    slot: np.ndarray,
    bundle: IntArray,
    counts: IntArray,
    dirty: np.ndarray,
) -> None:
    """Remove surfels that the newest picture contradicts, or that had no answer for too long.

    depth_m: with support. elapsed_s: since the camera's picture before, as far as time counts.
    """
    surfels, edge = surfels_at(bundle), place[3]
    height, width = depth_m.shape
    counts[Count.CONTRADICTED] = counts[Count.UNANSWERED] = 0
    for row in range(counts[Count.TOP]):
        if surfels.cells[row] < 0 or surfels.seen[row] == counts[Count.PICTURE]:
            continue
        a = to_camera(view, load(surfels.points_m, row))
        sd = sd_at(view, a[2])
        if not surfels.shown[row] and counts[Count.PICTURE] - surfels.seen[row] > _UNCONFIRMED:
            slot[surfels.cells[row]] = -1
            surfels.cells[row] = -1
            surfels.free[counts[Count.FREE]] = row
            counts[Count.FREE] += 1
            continue
        if a[2] < _NEAR * view[LEAST] + edge + _SIGMAS * sd or a[2] > view[MOST] - _SIGMAS * sd:
            continue
        i, j = pixel_of(view, a)
        if i < 1 or j < 1 or i >= height - 1 or j >= width - 1:
            continue
        least, holes = _window(depth_m, own, i, j)
        if holes < 0:
            continue
        gone = False
        if holes > _MOST_HOLES:
            # What is measured there in front hides it.
            if holes < 9 and least < a[2] - edge:
                continue
            surfels.unanswered_s[row] += elapsed_s
            gone = surfels.unanswered_s[row] > _UNANSWERED_S
            counts[Count.UNANSWERED] += gone
        elif least - _SIGMAS * sd_at(view, least) > a[2] + 0.5 * edge:
            surfels.evidence[row] -= 1
            gone = surfels.evidence[row] <= 0
            counts[Count.CONTRADICTED] += gone
        elif pixels_across(view, edge, a[2]) >= _FINE and least > a[2] - _HIDDEN * sd - edge:
            # Something is measured about there, but at other surfels, and so often that it is noise.
            surfels.unanswered_s[row] += elapsed_s
            gone = not surfels.shown[row] or surfels.unanswered_s[row] > _UNANSWERED_S
            counts[Count.CONTRADICTED] += gone
        if gone:
            if surfels.shown[row]:
                dirty[block_of(cells, surfels.cells[row])] = 1
            slot[surfels.cells[row]] = -1
            surfels.cells[row] = -1
            surfels.free[counts[Count.FREE]] = row
            counts[Count.FREE] += 1
