"""Update of a scene table by a frame of movers: one compiled call checks the movers' numbers and writes their rows."""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import BOOL, INT64, compiled, inlined, input_array, input_indices, output_array
from robot_side.surroundings.blocks import bound_blocks
from robot_side.surroundings.bounds import write_around
from robot_side.surroundings.kinds.layout import NUMBERS, SHAPE_NUMBERS, VELOCITY
from robot_side.surroundings.placing import place_one
from robot_side.surroundings.scene_columns import SCENE, SceneColumns
from robot_side.surroundings.validity import is_possible

WRITTEN: Final = 0
FLAT: Final = 1
"""Result: a primitive has no volume, so nothing was written"""
IMPOSSIBLE: Final = 2
"""Result: a primitive's numbers are invalid, so nothing was written"""
_scene = SCENE.at


@inlined
def _take(numbers: FloatArray, own: int, shape: FloatArray) -> None:
    for entry in range(NUMBERS):
        shape[0, entry] = numbers[own, entry]


@inlined
def _judged(
    scene: SceneColumns, things: IntArray, numbers: FloatArray, measured: bool, shape: FloatArray, bound: FloatArray
) -> int:
    """Return the result that `write_movers` will have; write nothing."""
    own, found = 0, WRITTEN
    for k in range(things.size):
        for row in range(scene.first_rows[things[k]], scene.first_rows[things[k] + 1]):
            if not is_possible(scene.kinds[row], numbers, own):
                return IMPOSSIBLE
            _take(numbers, own, shape)
            if not place_one(scene.kinds[row], shape, 0, bound, 0) > 0.0:
                found = FLAT
            own += 1
    for k in range(own, own + things.size):
        for axis in range(VELOCITY, VELOCITY + 3):
            if measured and not math.isfinite(numbers[k, axis]):
                return IMPOSSIBLE
    return found


@compiled(
    *(input_array(2), input_indices(), input_indices(), input_indices(), BOOL, BUNDLE),
    *(output_array(2), output_array(2)),
    returns=INT64,
)
def write_movers(
    numbers: FloatArray,
    things: IntArray,
    places: IntArray,
    blocks: IntArray,
    measured: bool,
    bundle: IntArray,
    shape: FloatArray,
    bound: FloatArray,
) -> int:
    """Write the primitives of the objects `things` (m,) and bound their blocks. Return WRITTEN, FLAT or IMPOSSIBLE.

    numbers (n + m, 20) as in `movers`. places (m,): each object's position in the order of the blocks, or -1. blocks:
    rising indices of the blocks with these objects. measured: whether the numbers include velocities. shape (1, 20),
    bound (1, 4): scratch.
    """
    scene = _scene(bundle)
    found = _judged(scene, things, numbers, measured, shape, bound)
    if found != WRITTEN:
        return found
    own = 0
    for k in range(things.size):
        thing, volume = things[k], 0.0
        first, end = scene.first_rows[thing], scene.first_rows[thing + 1]
        for row in range(first, end):
            _take(numbers, own, shape)
            volume += place_one(scene.kinds[row], shape, 0, scene.bounds, row)
            for entry in range(SHAPE_NUMBERS):
                scene.shapes[row, entry] = shape[0, entry]
            own += 1
        scene.object_volumes[thing] = volume
        write_around(scene.bounds, first, end, scene.object_bounds[thing])
        if places[k] >= 0:
            for entry in range(4):
                scene.ordered_bounds[places[k], entry] = scene.object_bounds[thing, entry]
    bound_blocks(scene.ordered_bounds, blocks, scene.block_bounds, scene.group_bounds)
    return WRITTEN
