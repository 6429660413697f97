"""Sum of the overlaps of a gripper's spheres with all objects, and the sum for each object (eq. 11-12)."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import FLOAT64, compiled, input_array, input_indices, output_array
from robot_side.compiled.vectors import add, load
from robot_side.field.inflation import around_spheres
from robot_side.field.object_class import SKIPPED
from robot_side.surroundings.bounds import passes
from robot_side.surroundings.kinds.layout import HALF_SPACE
from robot_side.surroundings.overlaps import overlap
from robot_side.surroundings.scene_columns import SCENE, next_object
from robot_side.surroundings.scene_table import SceneTable

_scene_at = SCENE.at
_NOWHERE = np.empty(0)


def total_overlap_m3(
    spheres: FloatArray, scene: SceneTable, classes: IntArray, of_objects_m3: FloatArray = _NOWHERE
) -> float:
    """Return Σ V_ij in m³ of spheres i (m, 4), centres and radii, with all objects j except those of the class SKIPPED.

    classes (k,): the objects'. of_objects_m3 (k,), if given, is filled with the sum for each object that is near; other
    entries stay. ValueError for a sphere that is not finite, because it would compare as far away.
    """
    still = np.zeros_like(spheres), np.zeros(3)
    total = sum_overlaps(spheres, *still, classes, scene.bundle, np.empty(3), of_objects_m3)
    if math.isnan(total):
        raise ValueError("spheres holds NaN or infinity; valid: finite numbers")
    return float(total)


SUM_OVERLAPS: Final = (
    *(input_array(2), input_array(2), input_array(1), input_indices(), BUNDLE, output_array(1), output_array(1)),
)
"""Argument types of `sum_overlaps`, for calls by address"""


@compiled(*SUM_OVERLAPS, returns=FLOAT64)
def sum_overlaps(
    spheres: FloatArray,
    inflated: FloatArray,
    moved: FloatArray,
    classes: IntArray,
    scene_bundle: IntArray,
    overlap_gradient: FloatArray,
    of_objects: FloatArray,
) -> float:
    """Return Σ V_ij in m³ as `total_overlap_m3` does; NaN if a number is not finite.

    inflated (m, 1 or more): its first column is added to the radii. moved (3,): added to all centres. overlap_gradient
    (3,): scratch.
    """
    scene, shift, count = _scene_at(scene_bundle), load(moved.reshape(1, 3), 0), spheres.shape[0]
    check = shift[0] + shift[1] + shift[2]
    for i in range(count):
        check += spheres[i, 0] + spheres[i, 1] + spheres[i, 2] + spheres[i, 3] + inflated[i, 0]
    if not math.isfinite(check):
        return math.nan
    middle, size = around_spheres(spheres, inflated, 0, count)
    middle, total, nowhere = add(middle, shift), 0.0, (0.0, 0.0, 0.0)
    place = next_object(scene, 0, middle, nowhere, 0.0, size)
    while place < scene.object_order.size:
        thing, mine = scene.object_order[place], 0.0
        place = next_object(scene, place + 1, middle, nowhere, 0.0, size)
        if classes[thing] == SKIPPED:
            continue
        for row in range(scene.first_rows[thing], scene.first_rows[thing + 1]):
            kind = scene.kinds[row]
            if kind != HALF_SPACE and not passes(middle, nowhere, 0.0, scene.bounds, row, size):
                continue
            for i in range(count):
                center, radius = add(load(spheres, i), shift), spheres[i, 3] + inflated[i, 0]
                if kind == HALF_SPACE or passes(center, nowhere, 0.0, scene.bounds, row, radius):
                    mine += overlap(
                        kind, scene.kernels, scene.shapes, row, center, radius, scene.meshes, overlap_gradient
                    )
        total += mine
        if of_objects.size > 0:
            of_objects[thing] = mine
    return total
