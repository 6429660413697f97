"""Choice of the target: centres of objects, and the next target when the operator presses the button for it."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import INT64, compiled, output_array
from robot_side.surroundings.kinds.layout import HALF_SPACE, TETRAHEDRON
from robot_side.surroundings.perceived import KINDS, PerceivedObjects
from robot_side.surroundings.scene_columns import SCENE
from robot_side.surroundings.scene_table import SceneTable

_OFF_AXIS_WEIGHT = 3.0
"""Factor by which distances across the approach axis count more than along it, when objects are ordered by nearness"""
_scene = SCENE.at


def object_centers(objects: PerceivedObjects) -> FloatArray:
    """Return each object's centre (k, 3), the mean of its primitives' centres, in m; NaN if infinite or ignored.

    A mesh's centre is that of its bounding box in its own frame.
    """
    count = len(objects.names)
    parts = [(kind.centers(*kind.read(objects)), getattr(objects, kind.owner)) for kind in KINDS if kind.centers]
    centers, owners = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    counts = np.bincount(owners, minlength=count)
    sums = np.column_stack([np.bincount(owners, weights=centers[:, axis], minlength=count) for axis in range(3)])
    with np.errstate(invalid="ignore"):
        centers_m: FloatArray = sums / np.where(counts > 0.0, counts, np.nan)[:, None]
    return centers_m


@compiled(BUNDLE, INT64, output_array(1))
def _center(bundle: IntArray, thing: int, center: FloatArray) -> None:
    scene, count = _scene(bundle), 0
    center[:] = 0.0
    for row in range(scene.first_rows[thing], scene.first_rows[thing + 1]):
        if scene.kinds[row] == HALF_SPACE:
            continue
        count += 1
        points = 4 if scene.kinds[row] == TETRAHEDRON else 1
        for axis in range(3):
            total = 0.0
            for point in range(points):
                total += scene.shapes[row, 3 * point + axis]
            center[axis] += total / points
    for axis in range(3):
        center[axis] = center[axis] / count if count > 0 else math.nan


def center_m(table: SceneTable, thing: int) -> FloatArray:
    """Return the centre (3,) of one object of a table, the mean over the primitives that have a volume."""
    center: FloatArray = np.empty(3)
    _center(table.bundle, thing, center)
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
