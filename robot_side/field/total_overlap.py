"""Sum of the overlaps of a gripper's spheres with all objects, and the sum for each object (eq. 11-12)."""

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import FLOAT64, compiled, input_array, input_indices, output_array
from robot_side.compiled.vectors import load
from robot_side.field.object_class import SKIPPED
from robot_side.surroundings.bounds import around, passes
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
    require_finite("spheres", spheres)
    whole = around(spheres, np.array([0, len(spheres)]))[0]
    return float(_sum_overlaps(spheres, whole, classes, scene.bundle, np.empty(3), of_objects_m3))


@compiled(*(input_array(2), input_array(1), input_indices(), BUNDLE, output_array(1), output_array(1)), returns=FLOAT64)
def _sum_overlaps(
    spheres: FloatArray,
    whole: FloatArray,
    classes: IntArray,
    scene_bundle: IntArray,
    overlap_gradient: FloatArray,
    of_objects: FloatArray,
) -> float:
    """Return Σ V_ij in m³ as `total_overlap_m3` does.

    whole (4,): a sphere around the spheres. overlap_gradient (3,): scratch.
    """
    scene, count, total, nowhere = _scene_at(scene_bundle), spheres.shape[0], 0.0, (0.0, 0.0, 0.0)
    middle, size = (whole[0], whole[1], whole[2]), whole[3]
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
                center, radius = load(spheres, i), spheres[i, 3]
                if kind == HALF_SPACE or passes(center, nowhere, 0.0, scene.bounds, row, radius):
                    mine += overlap(
                        kind, scene.kernels, scene.shapes, row, center, radius, scene.meshes, overlap_gradient
                    )
        total += mine
        if of_objects.size > 0:
            of_objects[thing] = mine
    return total
