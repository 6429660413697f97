"""Octree of a block's cells: the largest nodes whose surfels lie in a plane and fill their rectangle are patches."""

from typing import Final

import numpy as np

from common.arrays import IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.stack import on_stack
from robot_side.depth.grid import LEVELS, indices_of
from robot_side.depth.octree.patch_columns import PatchColumns
from robot_side.depth.octree.plane_fit import choose_normal, is_filled, is_flat, lay_rectangle, measure_rise, sum_up
from robot_side.depth.surfel_map.surfel_columns import SurfelColumns

NODES: Final = (8 ** (LEVELS + 1) - 1) // 7
"""Nodes of a block's octree"""
LENIENCE: Final = 1.4
"""Factor on the tolerances for a node that was a patch before, so that it stays one"""
_new_stack = on_stack(8 * (LEVELS + 1), 3, dtype=np.int64)
_new_ends = on_stack(9, dtype=np.int64)


@inlined
def _node(cells: IntArray, cell: int, level: int) -> int:
    """Return the number of the node at a level that holds a cell, in the cell's block."""
    i, j, k = indices_of(cells, cell)
    mask, across = (1 << LEVELS) - 1, LEVELS - level
    place = ((((i & mask) >> level) << across) + ((j & mask) >> level) << across) + ((k & mask) >> level)
    node: int = (8**across - 1) // 7 + place
    return node


@inlined
def _octant(cells: IntArray, cell: int, level: int) -> int:
    i, j, k = indices_of(cells, cell)
    return 4 * (i >> level & 1) + 2 * (j >> level & 1) + (k >> level & 1)


@building_block
def divide(
    surfels: SurfelColumns,
    cells: IntArray,
    members: IntArray,
    spare: IntArray,
    count: int,
    patches: PatchColumns,
    edge: float,
    was_patch: np.ndarray,
    nodes: int,
) -> int:
    """Divide the first `count` surfels of `members` (all of one block) into patches; return the number of patches.

    was_patch: 1 for nodes that were patches before; the block's begin at `nodes`.
    """
    stack, ends = _new_stack(), _new_ends()
    stack[0, 0], stack[0, 1], stack[0, 2] = 0, count, LEVELS
    depth, found = 1, 0
    while depth > 0:
        depth -= 1
        start, end, level = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        if found >= patches.nodes.size - 1:
            break
        single = end - start == 1
        node = _node(cells, surfels.cells[members[start]], 0 if single else level)
        if single or end - start > 2:
            sum_up(surfels, members, start, end, patches, found)
            choose_normal(patches, found, edge)
            lenience = LENIENCE if was_patch[nodes + node] else 1.0
            flat = single or is_flat(surfels, members, start, end, patches, found, edge, lenience)
            if flat:
                lay_rectangle(surfels, members, start, end, patches, found)
                flat = single or is_filled(surfels, members, start, end, patches, found, edge, lenience)
            was_patch[nodes + node] = flat
            if flat:
                measure_rise(patches, found, edge)
                patches.nodes[found] = node
                found += 1
                continue
        # Surfels of one octant stand side by side.
        for octant in range(9):
            ends[octant] = 0
        for place in range(start, end):
            spare[place] = members[place]
            ends[_octant(cells, surfels.cells[members[place]], level - 1) + 1] += 1
        ends[0] = start
        for octant in range(8):
            ends[octant + 1] += ends[octant]
        for octant in range(8):
            if ends[octant] < ends[octant + 1]:
                stack[depth, 0], stack[depth, 1], stack[depth, 2] = ends[octant], ends[octant + 1], level - 1
                depth += 1
        for place in range(start, end):
            octant = _octant(cells, surfels.cells[spare[place]], level - 1)
            members[ends[octant]] = spare[place]
            ends[octant] += 1
    return found
