"""Regions of a picture that are not where they were in an earlier one."""

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from robot_side.compiled.kernel import FLOAT64, INT64, array_of, compiled, input_array
from robot_side.compiled.vectors import dot
from robot_side.depth.motion.snapshots import FREE, SURFACE, Snapshot, surface_at
from robot_side.depth.picture import DepthArray, LabelArray
from robot_side.depth.view import DIRECTIONS, MASK, PICTURE, ray_at, sd_at, to_world, turned_to_world

LabelsArray = npt.NDArray[np.int32]
LABELS: Final = array_of(np.int32, 2)
"""Numba type of the numbers of regions (h, w); 0: none"""
_SIGMAS: Final = 2.0
"""Standard deviations from which on a pixel may be elsewhere; many together show it"""
_LEAST_M: Final = 0.0005
_TOGETHER: Final = 20.0
"""Least sum of the squares of a region's deviations, in variances of what errs as one"""
_AHEAD: Final = 1
"""Before what was there: it has come here"""
_BEHIND: Final = 2
"""A little behind what was there: it has gone, or was hidden"""
_BEHIND_M: Final = 0.05
_ALIKE: Final = 0.5
"""Least cosine between normals of one surface"""
AROUND: Final = 5
"""Pixels around those that have come that belong to their region"""
_CONTINUOUS: Final = 0.02
"""Share of the depth by which neighbours of one region may differ, beyond their errors"""
STILL_M: Final = 0.0001
"""Slack up to which a camera stands, so that what fills a hole has come: a moving one sees into holes by itself"""
_MOST_SQUARE: Final = 25.0
_MEAN: Final = 0.92
"""Mean of the squares of normal numbers, none above 2²"""
_FEWEST: Final = 6
"""Pixels that have come, of the smallest region"""
_MOST: Final = 12
"""Largest number of regions"""


class Regions(NamedTuple):
    """Regions that are not where they were."""

    labels: LabelsArray
    """(h, w) numbers of the regions, from 1; 0 or -1: none"""
    spreads: LabelsArray
    """(h, w) how many pixels further the region would reach: `AROUND` for those that are elsewhere by themselves"""
    number: int
    """How many there are"""
    noise: float
    """Variance of what stands still, as a share of that by the camera's errors"""


def moved_regions(newest: Snapshot, before: Snapshot, slack: tuple[float, float], pixels_alike: float) -> Regions:
    """Return what is not where it was. pixels_alike: number of pixels whose errors are one.

    slack: how far the camera's own motion may seem to move things at no depth, and more for each m of depth.
    """
    shape = newest.depth_m.shape
    kinds, labels, spreads = (np.zeros(shape, dtype) for dtype in (np.uint8, np.int32, np.int32))
    queue, squares = np.empty(labels.size, dtype=np.int32), np.empty(shape, dtype=np.float32)
    noise = _compare(*newest.arrays, *before.arrays, *slack, kinds, squares)
    least = _TOGETHER * pixels_alike
    count = _flood(newest.depth_m, newest.own, newest.view, kinds, squares, least, labels, spreads, queue)
    return Regions(labels, spreads, count, noise)


@compiled(
    *(PICTURE, DIRECTIONS, MASK, input_array(1), PICTURE, DIRECTIONS, MASK, input_array(1)),
    *(FLOAT64, FLOAT64, array_of(np.uint8, 2), array_of(np.float32, 2)),
    returns=FLOAT64,
)
def _compare(
    depth_m: DepthArray,
    normals: DepthArray,
    own: LabelArray,
    view: FloatArray,
    depth_before_m: DepthArray,
    normals_before: DepthArray,
    own_before: LabelArray,
    view_before: FloatArray,
    slack_m: float,
    slack: float,
    kinds: LabelArray,
    squares: DepthArray,
) -> float:
    """Write what has become of each pixel's surface, and the square of its deviation over the variance.

    Return the mean of these squares, but for what moves, against that of the errors.
    """
    total, count = 0.0, 0
    for i in range(depth_m.shape[0]):
        for j in range(depth_m.shape[1]):
            z, facing = 1.0 * depth_m[i, j], (1.0 * normals[i, j, 0], 1.0 * normals[i, j, 1], 1.0 * normals[i, j, 2])
            if z <= 0.0 or own[i, j]:
                continue
            # Thin things, and edges, have no normals: they are no evidence, but belong to what moves.
            plain = dot(facing, facing) > 0.0
            x, y = ray_at(view, i, j)
            point = to_world(view, (x * z, y * z, z))
            known, away, variance, normal = surface_at(point, depth_before_m, normals_before, own_before, view_before)
            if known == FREE and slack_m <= STILL_M:
                kinds[i, j], squares[i, j] = _AHEAD, _MOST_SQUARE if plain else 0.0
            if known == SURFACE and not plain and away > _BEHIND_M:
                kinds[i, j], squares[i, j] = _AHEAD, 0.0
            if known != SURFACE or not plain:
                continue
            variance += (sd_at(view, z) * dot(facing, (x, y, 1.0))) ** 2
            total += min(away * away / variance, _SIGMAS * _SIGMAS)
            count += 1
            beyond = abs(away) - slack_m - slack * z - _LEAST_M
            if beyond <= _SIGMAS * math.sqrt(variance):
                continue
            if away > 0.0:
                kinds[i, j], squares[i, j] = _AHEAD, min(beyond * beyond / variance, _MOST_SQUARE)
            elif away > -_BEHIND_M and dot(turned_to_world(view, facing), normal) > _ALIKE:
                kinds[i, j] = _BEHIND
    return total / (_MEAN * count) if count > 0 else 1.0


@compiled(
    *(PICTURE, MASK, input_array(1), MASK, PICTURE, FLOAT64, LABELS, LABELS, array_of(np.int32, 1)),
    returns=INT64,
)
def _flood(
    depth_m: DepthArray,
    own: LabelArray,
    view: FloatArray,
    kinds: LabelArray,
    squares: DepthArray,
    least: float,
    labels: LabelsArray,
    spreads: LabelsArray,
    queue: LabelsArray,
) -> int:
    """Number the regions; return how many there are. queue: memory."""
    height, width = depth_m.shape
    count = 0
    for start in range(labels.size):
        if kinds[start // width, start % width] != _AHEAD or labels[start // width, start % width] != 0:
            continue
        first, end, came, square = 0, 1, 0, 0.0
        queue[0] = start
        labels[start // width, start % width] = count + 1
        spreads[start // width, start % width] = AROUND
        while first < end:
            i, j = queue[first] // width, queue[first] % width
            first += 1
            if kinds[i, j] == _AHEAD:
                came += 1
                square += squares[i, j]
            z = 1.0 * depth_m[i, j]
            near = 3.0 * sd_at(view, z) + _CONTINUOUS * z
            for way in range(4):
                row, column = i + (way == 0) - (way == 1), j + (way == 2) - (way == 3)
                if row < 0 or column < 0 or row >= height or column >= width or labels[row, column] != 0:
                    continue
                spread = AROUND if kinds[row, column] != 0 else spreads[i, j] - 1
                there = depth_m[row, column]
                if spread < 0 or there <= 0.0 or own[row, column] or abs(there - z) > near:
                    continue
                labels[row, column], spreads[row, column] = count + 1, spread
                queue[end] = row * width + column
                end += 1
        if came >= _FEWEST and square >= least and count + 1 < _MOST:
            count += 1
        else:
            for place in range(end):
                labels[queue[place] // width, queue[place] % width] = -1
    return count
