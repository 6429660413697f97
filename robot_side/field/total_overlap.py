"""Sums of the overlaps of a gripper's spheres with all objects, whole and by what lies ahead (eq. 11-12).

A sum of overlaps is no volume: it counts space once for each sphere that covers it.
"""

from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import FLOAT64, compiled, input_array, input_indices, output_array
from robot_side.compiled.vectors import dot, load, negative, norm, subtract
from robot_side.field.object_class import SKIPPED, TARGET
from robot_side.surroundings.bounds import around, passes
from robot_side.surroundings.kinds.layout import HALF_SPACE
from robot_side.surroundings.overlaps import overlap
from robot_side.surroundings.scene_columns import SCENE, next_object
from robot_side.surroundings.scene_table import SceneTable

_scene_at = SCENE.at
_NO_DIRECTION: Final = np.zeros(3)
_SWALLOWED: Final = 1e-9
"""Gradient |∇V| over R² up to which a sphere counts as one that has swallowed the primitive, or lies within it"""


class OverlapsAlong(NamedTuple):
    """Σ V_ij in m³, whole and by where the overlaps lie."""

    all_m3: float
    ahead_m3: float
    """Σ V_ij max(0, û·n), n the unit vector from sphere i towards its overlap with j"""
    behind_m3: float
    """Σ V_ij max(0, -û·n)"""


def total_overlap_m3(spheres: FloatArray, scene: SceneTable, classes: IntArray) -> float:
    """Return Σ V_ij in m³ of spheres i (m, 4), centres and radii, with all objects j except those of the class SKIPPED.

    classes (k,): the objects'. ValueError for a sphere that is not finite, because it would compare as far away.
    """
    return overlaps_along(spheres, spheres[:, 3], _NO_DIRECTION, scene, classes).all_m3


def overlaps_along(
    spheres: FloatArray, radii_to_target_m: FloatArray, direction: FloatArray, scene: SceneTable, classes: IntArray
) -> OverlapsAlong:
    """Return the sums of all overlaps as `total_overlap_m3` does, and by where they lie along a unit vector û (3,).

    n is ∇V/|∇V|, the way on which the overlap grows fastest; for a sphere around a whole primitive, or within one, it
    points to the primitive's middle, or into the half-space. A sphere at that middle counts as ahead and as behind.
    radii_to_target_m (m,): radii that count for objects of the class TARGET, none larger than the spheres'.
    """
    require_finite("spheres", spheres)
    to_target_m = np.ascontiguousarray(radii_to_target_m)
    require_finite("radii_to_target_m", to_target_m)
    whole, along = around(spheres, np.array([0, len(spheres)]))[0], np.empty(2)
    given = spheres, to_target_m, np.ascontiguousarray(direction), whole, classes, scene.bundle
    total_m3 = _sum_overlaps(*given, np.empty(3), along)
    return OverlapsAlong(float(total_m3), *map(float, along))


@compiled(
    *(input_array(2), input_array(1), input_array(1), input_array(1), input_indices(), BUNDLE),
    *(output_array(1), output_array(1)),
    returns=FLOAT64,
)
def _sum_overlaps(
    spheres: FloatArray,
    radii_to_target: FloatArray,
    direction: FloatArray,
    whole: FloatArray,
    classes: IntArray,
    scene_bundle: IntArray,
    overlap_gradient: FloatArray,
    along: FloatArray,
) -> float:
    """Return Σ V_ij in m³ as `total_overlap_m3` does; fill `along` (2,) with what lies ahead and behind.

    whole (4,): a sphere around the spheres. overlap_gradient (3,): scratch.
    """
    scene, count, total, nowhere = _scene_at(scene_bundle), spheres.shape[0], 0.0, (0.0, 0.0, 0.0)
    middle, size, forth = (whole[0], whole[1], whole[2]), whole[3], (direction[0], direction[1], direction[2])
    place, ahead, behind = next_object(scene, 0, middle, nowhere, 0.0, size), 0.0, 0.0
    while place < scene.object_order.size:
        thing = scene.object_order[place]
        place = next_object(scene, place + 1, middle, nowhere, 0.0, size)
        if classes[thing] == SKIPPED:
            continue
        for row in range(scene.first_rows[thing], scene.first_rows[thing + 1]):
            kind = scene.kinds[row]
            if kind != HALF_SPACE and not passes(middle, nowhere, 0.0, scene.bounds, row, size):
                continue
            for i in range(count):
                center, radius = load(spheres, i), spheres[i, 3]
                if classes[thing] == TARGET:
                    radius = radii_to_target[i]
                if kind == HALF_SPACE or passes(center, nowhere, 0.0, scene.bounds, row, radius):
                    volume = overlap(
                        kind, scene.kernels, scene.shapes, row, center, radius, scene.meshes, overlap_gradient
                    )
                    total += volume
                    towards = (overlap_gradient[0], overlap_gradient[1], overlap_gradient[2])
                    if norm(towards) <= _SWALLOWED * radius * radius:
                        if kind == HALF_SPACE:
                            towards = negative(load(scene.shapes, row))
                        else:
                            towards = subtract(load(scene.bounds, row), center)
                    length = norm(towards)
                    # Where there is no direction, as at a box's middle, it counts for both.
                    cosine = dot(forth, towards) / length if length > 0.0 else 0.0
                    ahead += volume * (max(cosine, 0.0) if length > 0.0 else 1.0)
                    behind += volume * (max(-cosine, 0.0) if length > 0.0 else 1.0)
    along[0], along[1] = ahead, behind
    return total
