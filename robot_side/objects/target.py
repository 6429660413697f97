"""Which object is the target: found in a frame, and switched by the operator's button."""

import weakref
from typing import Any

import numpy as np

from common.arrays import FloatArray
from robot_side.objects.mesh_bounds import placed_middles
from robot_side.objects.perceived import PerceivedObjects, Role

_OFF_AXIS_WEIGHT = 3.0
"""A metre off the approach axis puts an object as far back in the order as three along it."""


def object_centers(objects: PerceivedObjects) -> FloatArray:
    """(k, 3) the mean of each object's primitives' centres, in metres; NaN for half-spaces and ignored objects.

    A mesh's centre is that of its bounding box in its own frame.
    """
    count = len(objects.names)
    of_kinds = (
        (objects.sphere_centers_m, objects.sphere_object),
        (objects.box_centers_m, objects.box_object),
        (objects.tetrahedron_vertices_m.mean(axis=1), objects.tetrahedron_object),
        (placed_middles(objects), objects.mesh_object),
    )
    centers, owners = (np.concatenate(parts) for parts in zip(*of_kinds, strict=True))
    counts = np.bincount(owners, minlength=count)
    sums = np.column_stack([np.bincount(owners, weights=centers[:, axis], minlength=count) for axis in range(3)])
    with np.errstate(invalid="ignore"):
        centers_m: FloatArray = sums / np.where(counts > 0.0, counts, np.nan)[:, None]
    return centers_m


_newest_centers: "weakref.WeakKeyDictionary[PerceivedObjects, FloatArray]" = weakref.WeakKeyDictionary()


def object_center(objects: PerceivedObjects, index: int) -> FloatArray:
    """The row (3,) of `object_centers` of one object, at the cost of what is new in the frame."""
    if objects.since is not None:
        movers, moved = objects.since
        place = movers.place_of(index)
        objects, index = (movers.first, index) if place is None else (moved, place)
    centers_m = _newest_centers.get(objects)
    if centers_m is None:
        centers_m = _newest_centers[objects] = object_centers(objects)
    center_m: FloatArray = centers_m[index]
    return center_m


def target_index(objects: PerceivedObjects) -> int | None:
    """The object whose role is the target; None when there is none."""
    # Frames share their roles, which may be many.
    if _newest_target[0] is not objects.roles:
        roles = objects.roles
        _newest_target[:] = [roles, roles.index(Role.TARGET) if Role.TARGET in roles else None]
    found: int | None = _newest_target[1]
    return found


_newest_target: list[Any] = [None, None]
"""The roles that were searched last, and what was found."""


def next_target(
    objects: PerceivedObjects, centers_m: FloatArray, tool_position_m: FloatArray, approach: FloatArray
) -> str | None:
    """The object to become the target when the operator asks for another one; None when there is no other.

    The obstacles and the target ahead of the tool stand in an order of nearness along the approach axis; the
    one after the present target follows it, and the first one follows the last, or a target without a centre.
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
    present = target_index(objects)
    if present is None or present not in order:
        return objects.names[order[0]] if order else None
    follower = order[(order.index(present) + 1) % len(order)]
    return None if follower == present else objects.names[follower]
