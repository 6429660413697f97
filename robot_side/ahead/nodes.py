"""At which ways a ramp's overlaps are worked out: its nodes, close where it rises, and far apart along a graze."""

import math
from typing import Final

import numpy as np

from robot_side.ahead.tables import FIRST, GOING, NEW, NODES, Record
from robot_side.compiled.kernel import building_block, inlined

NODES_PER_MARGIN: Final = 6
_NODES_FOR_MORE: Final = 30
"""From so many nodes on, a graze goes on in steps as long as it takes to have enough of them for its whole way."""


@inlined
def ends(ramp: Record, margin: float, reach: float) -> float:
    """So far a ramp's nodes go: to where it is full, where it begins to rise within the reach."""
    return reach if math.isnan(ramp.free) else max(reach, ramp.free + margin)


@inlined
def is_spent(ramp: Record, margin: float, reach: float) -> bool:
    """Whether a ramp has all its nodes."""
    last = ramp.nodes - 1
    return bool(
        ramp.state == GOING and (last == NODES - 1 or (last >= 0 and ramp.way[last] >= ends(ramp, margin, reach)))
    )


@building_block
def _step(ramp: Record, pairs: np.ndarray, nodes: int, last: float, margin: float, end: float) -> float:
    """How far it is from the node at `last`, of so many, to the next one."""
    short, long = margin / NODES_PER_MARGIN, 0.5 * margin
    if not ramp.free + margin <= last * (1.0 + 1e-9):
        return short
    # A graze goes on in long steps, but where it meets something more.
    if nodes > _NODES_FOR_MORE:
        return max(long, (end - last) / (NODES - nodes))
    for k in range(ramp.first_pair, ramp.first_pair + ramp.pairs):
        if max(ramp.free, last - margin) < pairs[k].entry < last + long:
            return short
    return long


@building_block
def plan(ramp: Record, pairs: np.ndarray, margin: float, reach: float) -> None:
    """Decide where the ramp's next nodes are, if it has any."""
    if ramp.state == NEW:
        ramp.state, ramp.free, ramp.floor, ramp.lean, ramp.nodes = GOING, math.nan, 0.0, 0.0, 0
        if ramp.start > 0.0:
            # Nothing overlaps before: this node is known.
            ramp.free, ramp.way[0], ramp.volume[0], ramp.slope[0], ramp.nodes = ramp.start, ramp.start, 0.0, 0.0, 1
        else:
            ramp.state, ramp.way[0], ramp.asked = FIRST, 0.0, 1
            for axis in range(3):
                ramp.push[axis] = 0.0
            return
    count = 0
    if ramp.nodes == 0:
        ramp.way[0] = last = ramp.start
        count = 1
    else:
        last = ramp.way[ramp.nodes - 1]
    end = ends(ramp, margin, reach)
    for _ in range(NODES_PER_MARGIN):
        if ramp.nodes + count < NODES and last < end:
            last += _step(ramp, pairs, ramp.nodes + count, last, margin, end)
            ramp.way[ramp.nodes + count] = last
            count += 1
    ramp.asked = count
