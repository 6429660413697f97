"""Bounding volume hierarchy: blocks of 64 neighbouring objects, and groups of 64 blocks.

A far block is skipped at once. Objects are ordered along a space-filling curve (Morton 1966), so no tree is needed. The
order stays when objects move; only the bounds of the blocks follow them.
"""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import compiled, inlined, input_array, input_indices, output_array
from robot_side.surroundings.bounds import write_around

TOGETHER: Final = 64
"""Number of objects in a block, and of blocks in a group"""
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
    places = np.zeros(len(there), dtype=np.uint64)
    for axis in range(3):
        places |= _spread(cells[:, axis]) << np.uint64(axis)
    return there[np.lexsort((places, ~endless))]


def _spread(numbers: np.ndarray) -> np.ndarray:
    """Return each 16-bit number (n,) with two zeros inserted after each bit."""
    for shift, mask in ((16, 0x0000FF0000FF), (8, 0x00F00F00F00F), (4, 0x0C30C30C30C3), (2, 0x249249249249)):
        numbers = (numbers | (numbers << np.uint64(shift))) & np.uint64(mask)
    return numbers


@inlined
def bound_blocks(bounds: FloatArray, which: IntArray, blocks: FloatArray, groups: FloatArray) -> None:
    """Write the bounds of the blocks `which` (rising indices), and of the groups that contain these blocks.

    bounds (o, 4): of the objects, in the order of the blocks.
    """
    for k in range(which.size):
        first = which[k] * TOGETHER
        write_around(bounds, first, min(first + TOGETHER, bounds.shape[0]), blocks[which[k]])
    done = -1
    for k in range(which.size):
        group = which[k] // TOGETHER
        if group != done:
            write_around(blocks, group * TOGETHER, min((group + 1) * TOGETHER, blocks.shape[0]), groups[group])
            done = group


@compiled(input_array(2), input_indices(), output_array(2), output_array(2))
def _bound(bounds: FloatArray, which: IntArray, blocks: FloatArray, groups: FloatArray) -> None:
    bound_blocks(bounds, which, blocks, groups)


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
        _bound(self.bounds, np.arange(len(self.blocks)), self.blocks, self.groups)

    def places(self, things: IntArray) -> IntArray:
        """Return the position in `order` of each of these objects; -1 for an object without bounds."""
        found = np.full(len(self._object_bounds), -1)
        found[self.order] = np.arange(len(self.order))
        return found[things]
