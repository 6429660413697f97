"""Bounding volume hierarchy: blocks of 64 neighbouring objects, and groups of 64 blocks.

A far block is skipped at once. Objects are ordered along a space-filling curve (Morton 1966), so no tree is needed. The
order stays when objects move; only the bounds of the blocks follow them.
"""

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.surroundings.bounds import around

TOGETHER: Final = 64
"""Number of objects in a block, and of blocks in a group"""
_CELL_M: Final = 0.005
_CELLS: Final = 1 << 16
"""Number of cells along each axis, in which the curve orders the positions"""


def in_blocks(object_bounds: FloatArray) -> IntArray:
    """Return the indices of the objects that have bounds, in the order of the blocks; infinite objects come first.

    object_bounds (k, 4): centre and radius; a negative radius means no bounds. Objects that fit in one block keep their
    order.
    """
    there = np.flatnonzero(object_bounds[:, 3] >= 0.0)
    if len(there) <= TOGETHER:
        return there
    centers_m, endless = object_bounds[there, :3], np.isinf(object_bounds[there, 3])
    low = centers_m[~endless].min(axis=0, initial=math.inf)
    extent = centers_m[~endless].max(axis=0, initial=-math.inf) - low
    with np.errstate(invalid="ignore", divide="ignore"):
        cells = np.nan_to_num((centers_m - low) / extent * (_CELLS - 1))
    cells = np.clip(cells, 0, _CELLS - 1).astype(np.uint64)
    return there[np.lexsort((_on_curve(cells), ~endless))]


def places_on_curve(points_m: FloatArray) -> np.ndarray:
    """Return the place (n,) of each point (n, 3) on a space-filling curve, which is the same for all points."""
    cells = np.floor(points_m / _CELL_M).astype(np.int64).astype(np.uint64) & np.uint64(_CELLS - 1)
    return _on_curve(cells)


def _on_curve(cells: np.ndarray) -> np.ndarray:
    places: np.ndarray = _spread(cells[:, 0])
    for axis in (1, 2):
        places = places | _spread(cells[:, axis]) << np.uint64(axis)
    return places


def _spread(numbers: np.ndarray) -> np.ndarray:
    """Return each 16-bit number (n,) with two zeros inserted after each bit."""
    for shift, mask in ((16, 0x0000FF0000FF), (8, 0x00F00F00F00F), (4, 0x0C30C30C30C3), (2, 0x249249249249)):
        numbers = (numbers | (numbers << np.uint64(shift))) & np.uint64(mask)
    return numbers


class Together(NamedTuple):
    """Blocks of objects, or groups of blocks, and where their members are."""

    which: IntArray
    """(w,) indices of the blocks"""
    members: IntArray
    """(m,) indices of all members, block after block"""
    starts: IntArray
    """(w + 1,) where each block's members begin, and m"""

    def bound(self, members: FloatArray, blocks: FloatArray) -> None:
        """Write the bounds of these blocks into `blocks` (b, 4). members (n, 4): bounds of all members there are."""
        blocks[self.which] = around(members[self.members], self.starts)


def together(which: IntArray, count: int) -> Together:
    """Return these blocks of `count` members in all."""
    members = (which[:, None] * TOGETHER + np.arange(TOGETHER)).ravel()
    ends = np.minimum((which + 1) * TOGETHER, count) - which * TOGETHER
    return Together(which, members[members < count], np.concatenate([[0], ends.cumsum()]))


class Blocks:
    """Order of a scene's objects, and bounds of their blocks."""

    def __init__(self, object_bounds: FloatArray) -> None:
        """object_bounds (k, 4): centres and radii."""
        self.order = in_blocks(object_bounds)
        """(o,) indices of the objects that have bounds, in the order of the blocks"""
        self._object_bounds = object_bounds
        self.bounds: FloatArray = object_bounds[self.order]
        """(o, 4) centre and radius around each object, in `order`"""
        self.blocks: FloatArray = np.empty((-(-len(self.order) // TOGETHER), 4))
        """(b, 4) centre and radius around each block"""
        self.groups: FloatArray = np.empty((-(-len(self.blocks) // TOGETHER), 4))
        """(c, 4) centre and radius around each group of blocks"""
        self.bound(np.arange(len(self.order)))()

    def places(self, things: IntArray) -> IntArray:
        """Return the position in `order` of each of these objects; -1 for an object without bounds."""
        found = np.full(len(self._object_bounds), -1)
        found[self.order] = np.arange(len(self.order))
        return found[things]

    def bound(self, places: IntArray) -> Callable[[], None]:
        """Return a function that bounds the blocks and groups with the objects at these positions of `order` anew."""
        which = np.unique(places // TOGETHER)
        blocks, groups = together(which, len(self.bounds)), together(np.unique(which // TOGETHER), len(self.blocks))

        def bound() -> None:
            blocks.bound(self.bounds, self.blocks)
            groups.bound(self.blocks, self.groups)

        return bound
