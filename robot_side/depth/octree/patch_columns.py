"""Tables of patches, which are found in one block, and of boxes, which stay."""

from enum import IntEnum
from typing import Final, NamedTuple

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import INDICES, NUMBERS, Declared, rows


class PatchColumns(NamedTuple):
    """Pieces of surface that each fit a plane: their surfels' moments, and a rectangle in the plane."""

    nodes: IntArray
    """(n,) node of the octree; of merged patches the first one's. -1: merged into another"""
    roles: IntArray
    """(n,) index in ROLES; -1: none"""
    counts: FloatArray
    """(n,) number of surfels"""
    means_m: FloatArray
    """(n, 3) mean of the surfels' points"""
    moments_m2: FloatArray
    """(n, 6) covariance of the surfels' points: xx, yy, zz, xy, xz, yz"""
    spreads_m2: FloatArray
    """(n, 6) mean of the surfels' own covariances"""
    normals: FloatArray
    """(n, 3) sum of the surfels' normals"""
    lengths: FloatArray
    """(n,) sum of the lengths of the surfels' normals"""
    noises_m2: FloatArray
    """(n,) mean of the surfels' noise"""
    sds_m: FloatArray
    """(n,) largest standard deviation of the surfels"""
    axes: FloatArray
    """(n, 9) axes of the rectangle, two along its edges, and the normal towards free space"""
    lows_m: FloatArray
    """(n, 2) lower ends of the rectangle along its edges, from the mean"""
    highs_m: FloatArray
    """(n, 2) upper ends"""
    rises_m: FloatArray
    """(n,) distance by which the foremost is before the mean"""


PATCHES: Final = Declared(
    PatchColumns,
    *(INDICES, INDICES, NUMBERS, rows(3), rows(6), rows(6), rows(3)),
    *(NUMBERS,) * 3,
    *(rows(9), rows(2), rows(2), NUMBERS),
)
patches_at: Final = PATCHES.at


class BoxColumns(NamedTuple):
    """Boxes that stay from picture to picture."""

    centers_m: FloatArray
    axes: FloatArray
    """(n, 9) axes as in a patch"""
    halves_m: FloatArray
    sds_m: FloatArray
    roles: IntArray
    nodes: IntArray
    """(n,) node that the box is of; -1: free"""
    following: IntArray
    """(n,) next box of the same block; -1: none"""
    found: IntArray
    """(n,) 1 if it was found again"""
    free: IntArray
    """(n,) rows that are free again"""


BOXES: Final = Declared(
    BoxColumns,
    *(rows(3), rows(9), rows(3), NUMBERS),
    *(INDICES,) * 5,
)
boxes_at: Final = BOXES.at


class BoxCount(IntEnum):
    """Counts of a table of boxes, as indices."""

    TOP = 0
    FREE = 1
    CHANGED = 2


def patch_columns(count: int) -> PatchColumns:
    """Return a table for `count` patches."""
    return PatchColumns(*PATCHES.empty(count))


def box_columns(count: int) -> BoxColumns:
    """Return a table for `count` boxes, all free."""
    boxes = BoxColumns(*BOXES.empty(count))
    boxes.nodes[:] = -1
    return boxes
