"""Loop over many pairs of one kind. Bounds settle most pairs; the others are gathered into full blocks and computed."""

from collections.abc import Callable
from typing import Any

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.stack import on_stack
from robot_side.overlap.lanes import (
    LANES,
    NOTHING,
    PARTIAL,
    RESULT_COLUMNS,
    SOME_DOUBTFUL,
    SOME_PARTIAL,
    WHOLE_SOLID,
    WIDTH,
    column,
    copy_lane,
    lane_groups,
    scatter,
)
from robot_side.overlap.solids.solid import sphere_area, sphere_volume

Run = Callable[[FloatArray, FloatArray, Any, FloatArray, FloatArray, FloatArray, IntArray], int]


def found_columns(inputs: int) -> tuple[int, int, int]:
    """Return the first indices of a block's columns after its `inputs`: verdict, solid's volume and result."""
    return inputs, inputs + 1, inputs + 2


@inlined
def _fill_group(block: FloatArray, count: int, inputs: int) -> None:
    """Fill the unused lanes of the last group, those from `count` on, with copies of the first lane."""
    for lane in range(count, lane_groups(count) * WIDTH):
        copy_lane(block, 0, block, lane, inputs)


def batch(
    load: Callable[[FloatArray, FloatArray, Any, int, int, FloatArray], None],
    bound: Callable[[FloatArray, int], int],
    compute: Callable[[FloatArray, int], None],
    inputs: int,
) -> Run:
    """Return the loop over spheres `centers` (p, 3), `radii` (p,) and `solids`, a tuple of arrays; in kernels only.

    A block has `inputs` columns for the pair, then columns for the verdict, the solid's volume and the result. `load`
    fills the first columns with `count` pairs, from pair `first` on. `bound` fills verdicts and volumes of the first
    groups of lanes, and returns the sum of weights and doubts. `compute` fills the results.

    The loop's result arrays must be filled with zeros before. Pairs that need precise forms go to the first entries of
    `rows` (p + 1,); the loop returns their number. The last entry of `rows` is the number n of pairs that bounds did
    not settle. It is ~n, below 0, if an argument may be NaN or out of range.
    """
    bounds, solid_volume, result = found_columns(inputs)
    lanes, indices = on_stack((result + RESULT_COLUMNS) * LANES), on_stack(LANES, dtype=np.int64)

    @inlined
    def run(
        centers: FloatArray,
        radii: FloatArray,
        solids: Any,
        volumes: FloatArray,
        gradients: FloatArray,
        areas: FloatArray,
        rows: IntArray,
    ) -> int:
        block, waiting, pairs, own = lanes(), lanes(), indices(), indices()
        waiting_count = unsettled = partial = doubtful = 0
        total = radii.size
        for first in range(0, total, LANES):
            count = min(LANES, total - first)
            groups = lane_groups(count)
            load(centers, radii, solids, first, count, block)
            _fill_group(block, count, inputs)
            left = bound(block, groups)
            doubtful += left // SOME_DOUBTFUL
            left %= SOME_DOUBTFUL
            if left == 0:
                continue
            if left == groups * WIDTH * SOME_PARTIAL:
                # All lanes are partial: compute in place.
                compute(block, groups)
                partial += count
                for lane in range(count):
                    own[lane] = first + lane
                unsettled = scatter(block, result, own, count, volumes, gradients, areas, rows, unsettled)
                continue
            for lane in range(count):
                verdict = column(block, bounds, lane)
                if verdict == NOTHING:
                    continue
                pair = first + lane
                if verdict == PARTIAL:
                    copy_lane(block, lane, waiting, waiting_count, inputs)
                    pairs[waiting_count] = pair
                    waiting_count += 1
                    if waiting_count == LANES:
                        compute(waiting, LANES // WIDTH)
                        partial += LANES
                        unsettled = scatter(waiting, result, pairs, LANES, volumes, gradients, areas, rows, unsettled)
                        waiting_count = 0
                elif verdict == WHOLE_SOLID:
                    volumes[pair] = column(block, solid_volume, lane)
                else:
                    volumes[pair], areas[pair] = sphere_volume(radii[pair]), sphere_area(radii[pair])
        if waiting_count > 0:
            _fill_group(waiting, waiting_count, inputs)
            compute(waiting, lane_groups(waiting_count))
            partial += waiting_count
            unsettled = scatter(waiting, result, pairs, waiting_count, volumes, gradients, areas, rows, unsettled)
        rows[total] = ~partial if doubtful > 0 else partial
        return unsettled

    return run
