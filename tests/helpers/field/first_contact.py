"""Distance that a sphere moves until it touches a scene's first primitive, by the compiled function that looks use."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import FLOAT64, compiled, input_array
from robot_side.compiled.vectors import load
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_columns import SCENE, contact_with
from robot_side.surroundings.scene_table import scene_table

_scene_at = SCENE.at


def first_contact_m(
    objects: PerceivedObjects, start_m: FloatArray, radius_m: float, direction: FloatArray, reach_m: float
) -> float:
    """Return the distance along the unit vector `direction` (3,); 0 for an overlap now, infinite beyond `reach_m`."""
    # A bundle holds addresses of the table's arrays, and does not keep them alive.
    from_and_along, table = np.stack([start_m, direction]), scene_table(objects)
    found = float(_first_contact(from_and_along, radius_m, reach_m, table.bundle))
    return found if found <= reach_m else math.inf


@compiled(input_array(2), FLOAT64, FLOAT64, BUNDLE, returns=FLOAT64)
def _first_contact(from_and_along: FloatArray, radius: float, reach: float, bundle: IntArray) -> float:
    start, along = load(from_and_along, 0), load(from_and_along, 1)
    found, _ = contact_with(_scene_at(bundle), 0, start, along, radius, reach, False)
    return found
