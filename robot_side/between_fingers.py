"""The target between the fingers is where it should be: what overlaps there is no danger (§3.4, roles)."""

import numpy as np

from common.arrays import FloatArray
from robot_side.arm_port import GripperPose
from robot_side.nearest_object import distance_to_object
from robot_side.overlapping import NearestSurfaces
from robot_side.perceived_objects import PerceivedObjects, Role
from robot_side.proximity import CandidatePairs

_BESIDE = 0.5
_BETWEEN = 0.85
"""Cosines between a finger's inward direction and the way to the target: 60° off is beside, 32° between."""
_ENTERED_M = 0.015
"""While the point between the fingertips is this near to the target or nearer, the target is entering the gap."""


def outside_share(
    pose: GripperPose, objects: PerceivedObjects, pairs: CandidatePairs, nearest: NearestSurfaces
) -> FloatArray | None:
    """How much of each candidate pair's overlap counts: (p,) 1 but for fingers that have the target on their inside.

    There it falls smoothly to 0, as the target's nearest point comes to lie straight across the gap from the
    finger, or as the target reaches the point between the fingertips: from then on what lies ahead of the palm
    counts. None while no pair is of a finger and the target, which is 1 for all.
    """
    concerned = pose.sphere_on_finger[pairs.sphere_index]
    if not concerned.any():
        return None
    targets = np.array([role is Role.TARGET for role in objects.roles], dtype=np.bool_)
    rows = np.flatnonzero(concerned & targets[pairs.object_index])
    if len(rows) == 0:
        return None
    offset = pose.sphere_centers_m[pairs.sphere_index[rows]] - pose.tool_position_m
    approach = pose.tool_rotation[:, 2]
    across = offset - (offset @ approach)[:, None] * approach
    length = np.sqrt(np.einsum("pi,pi->p", across, across))
    inward = -across / np.where(length > 0.0, length, 1.0)[:, None]
    cosine = np.einsum("pi,pi->p", inward, nearest.direction[rows])
    x = np.clip((cosine - _BESIDE) / (_BETWEEN - _BESIDE), 0.0, 1.0)
    share: FloatArray = np.ones(len(pairs))
    gap_m = min(distance_to_object(objects, index, pose.tool_position_m) for index in np.flatnonzero(targets).tolist())
    share[rows] = (1.0 - x * x * (3.0 - 2.0 * x)) * min(1.0, max(0.0, gap_m / _ENTERED_M))
    return share
