"""Choice of the target: centres of objects, and the next target when the operator presses the button for it."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import INT64, compiled, output_array
from robot_side.surroundings.kinds.layout import HALF_SPACE, TETRAHEDRON
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_columns import SCENE
from robot_side.surroundings.scene_table import SceneTable

_OFF_AXIS_WEIGHT = 3.0
"""Factor by which distances across the approach axis count more than along it, when objects are ordered by nearness"""
_scene = SCENE.at


@compiled(BUNDLE, INT64, output_array(2))
def _center(bundle: IntArray, first: int, centers: FloatArray) -> None:
    """Fill the centres (m, 3) of the m objects from number `first` on."""
    scene = _scene(bundle)
    centers[:] = 0.0
    for k in range(centers.shape[0]):
        count = 0
        for row in range(scene.first_rows[first + k], scene.first_rows[first + k + 1]):
            if scene.kinds[row] == HALF_SPACE:
                continue
            count += 1
            points = 4 if scene.kinds[row] == TETRAHEDRON else 1
            for axis in range(3):
                total = 0.0
                for point in range(points):
                    total += scene.shapes[row, 3 * point + axis]
                centers[k, axis] += total / points
        for axis in range(3):
            centers[k, axis] = centers[k, axis] / count if count > 0 else math.nan


def object_centers(table: SceneTable) -> FloatArray:
    """Return each object's centre (k, 3), as `center_m` does; NaN for an object that is infinite or ignored."""
    centers: FloatArray = np.empty((len(table.first_rows) - 1, 3))
    _center(table.bundle, 0, centers)
    return centers


def center_m(table: SceneTable, thing: int) -> FloatArray:
    """Return the centre (3,) of one object of a table, the mean over its primitives that have a volume, in m.

    A mesh's centre is that of its bounding box in its own frame.
    """
    center: FloatArray = np.empty(3)
    _center(table.bundle, thing, center.reshape(1, 3))
    return center


def next_target(
    objects: PerceivedObjects,
    present: int | None,
    centers_m: FloatArray,
    tool_position_m: FloatArray,
    approach: FloatArray,
) -> str | None:
    """Return the name of the next target when the operator asks for another one; None if there is no other.

    Obstacles ahead of the tool, and the target, are ordered by the distance along the approach axis plus 3 times that
    across it. The object after the `present` target is next. The first object follows the last one, and also a target
    without a centre.
    centers_m (k, 3) from `object_centers`; `approach` is a unit vector (3,) in the world frame.
    """
    offsets = centers_m - tool_position_m
    along = offsets @ approach
    across = np.linalg.norm(offsets - along[:, None] * approach, axis=1)
    eligible = [
        index
        for index, role in enumerate(objects.roles)
        if (role is Role.OBSTACLE and along[index] > 0.0) or (role is Role.TARGET and np.isfinite(along[index]))
    ]
    order = sorted(eligible, key=lambda index: along[index] + _OFF_AXIS_WEIGHT * across[index])
    if present is None or present not in order:
        return objects.names[order[0]] if order else None
    follower = order[(order.index(present) + 1) % len(order)]
    return None if follower == present else objects.names[follower]
