"""Choice of the target: centres of objects, and the next target when the operator presses the button for it."""

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.surroundings.fixed_objects import is_fixed
from robot_side.surroundings.kinds.layout import HALF_SPACE, TETRAHEDRON
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable

_FARTHEST_M = 100.0
"""Distance along the approach from which on nothing is a next target, such as parked surfaces"""
_OFF_AXIS_WEIGHT = 3.0
"""Factor by which distances across the approach axis count more than along it, when objects are ordered by nearness"""


def object_centers(table: SceneTable) -> FloatArray:
    """Return each object's centre (k, 3), as `center_m` does; NaN for an object that is infinite or ignored."""
    return _centers(table.shapes, table.kinds, table.object_index, len(table.first_rows) - 1)


def center_m(table: SceneTable, thing: int) -> FloatArray:
    """Return the centre (3,) of one object of a table, the mean over its primitives that have a volume, in m.

    A mesh's centre is that of its bounding box in its own frame.
    """
    rows = slice(*table.first_rows[thing : thing + 2].tolist())
    kinds = table.kinds[rows]
    center: FloatArray = _centers(table.shapes[rows], kinds, np.zeros_like(kinds), 1)[0]
    return center


def extent_middle_m(objects: PerceivedObjects, thing: int) -> FloatArray:
    """Return the middle (3,) of the extent, along the world's axes, of an object of boxes, in m."""
    mine = objects.box_object == thing
    reach_m = np.einsum("bij,bj->bi", np.abs(objects.box_rotations[mine]), objects.box_half_sizes_m[mine])
    centers_m = objects.box_centers_m[mine]
    middle_m: FloatArray = 0.5 * ((centers_m - reach_m).min(axis=0) + (centers_m + reach_m).max(axis=0))
    return middle_m


def _centers(shapes: FloatArray, kinds: IntArray, owners: IntArray, count: int) -> FloatArray:
    """Return the centres (count, 3) of objects; owners (n,): each primitive's object."""
    points, four = shapes[:, :3], kinds == TETRAHEDRON
    if four.any():
        points = points.copy()
        points[four] = shapes[four, :12].reshape(-1, 4, 3).mean(axis=1)
    ends = kinds != HALF_SPACE
    owners, points = owners[ends], points[ends]
    sums = np.stack([np.bincount(owners, points[:, axis], count) for axis in range(3)], axis=1)
    with np.errstate(invalid="ignore"):
        centers: FloatArray = sums / np.bincount(owners, minlength=count)[:, None]
    return centers


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
        if (role is Role.OBSTACLE and 0.0 < along[index] < _FARTHEST_M and not is_fixed(objects.names[index]))
        or (role is Role.TARGET and np.isfinite(along[index]))
    ]
    order = sorted(eligible, key=lambda index: along[index] + _OFF_AXIS_WEIGHT * across[index])
    if present is None or present not in order:
        return objects.names[order[0]] if order else None
    follower = order[(order.index(present) + 1) % len(order)]
    return None if follower == present else objects.names[follower]
