"""Bounding volume hierarchy: blocks of objects that lie together, and blocks of blocks; far ones are skipped at once.

The order is that of a space-filling curve (Morton 1966). It needs no tree, and stays when objects move: the bounds of
their blocks follow them. A block skips 64 objects, a block of blocks 4 096.
"""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import compiled, inlined, input_array, input_indices, output_array
from robot_side.surroundings.bounds import write_around

TOGETHER: Final = 64
"""Objects in a block, and blocks in a block of blocks."""
_CELLS: Final = 1 << 16
"""Cells along each axis of the curve"""


def in_blocks(object_bounds: FloatArray) -> IntArray:
    """Return the order in blocks of the objects that have bounds (k, 4); infinite objects come first.

    Objects that fit in one block keep their order.
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
    """Return the 16 bits of each number (n,), with two zeros after each bit."""
    for shift, mask in ((16, 0x0000FF0000FF), (8, 0x00F00F00F00F), (4, 0x0C30C30C30C3), (2, 0x249249249249)):
        numbers = (numbers | (numbers << np.uint64(shift))) & np.uint64(mask)
    return numbers


@inlined
def bound_blocks(bounds: FloatArray, which: IntArray, blocks: FloatArray, groups: FloatArray) -> None:
    """Write the bounds of the blocks `which`, rising, and of the blocks around them. bounds (o, 4): in block order."""
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
    """Order of the objects, and bounds of their blocks."""

    def __init__(self, object_bounds: FloatArray, order: IntArray | None = None) -> None:
        """object_bounds (k, 4): the objects'. order: that of earlier positions; by default a new one."""
        self.order = in_blocks(object_bounds) if order is None else order
        """(o,) objects that have bounds"""
        self._object_bounds = object_bounds
        self.bounds: FloatArray = object_bounds[self.order]
        """(o, 4) of each object, in the order"""
        self.blocks: FloatArray = np.empty((-(-len(self.order) // TOGETHER), 4))
        """(b, 4) around each block"""
        self.groups: FloatArray = np.empty((-(-len(self.blocks) // TOGETHER), 4))
        """(c, 4) around each block of blocks"""
        _bound(self.bounds, np.arange(len(self.blocks)), self.blocks, self.groups)

    def places(self, things: IntArray) -> IntArray:
        """Return the place of each of these objects in the order; -1 for an object without bounds."""
        found = np.full(len(self._object_bounds), -1)
        found[self.order] = np.arange(len(self.order))
        return found[things]
