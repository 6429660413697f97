"""Distances from the gripper to perceived objects, for people to read; never from the simulation's truth."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from common.roles import Role
from robot_side.surroundings.distances import object_distances
from robot_side.surroundings.scene_table import SceneTable

_FIRST_REACH_M = 0.1
_FARTHEST_M = 3.2


@dataclass(frozen=True)
class PerceivedDistances:
    """Distances from the gripper's spheres (not enlarged) to the objects' perceived surfaces; negative inside."""

    nearest: str | None = None
    """Name of the nearest object that is neither a support nor held; None if there is none within about 3 m"""
    nearest_m: float | None = None
    target_m: float | None = None
    """Distance to the target; None if there is no target, if it is held, or if it is farther away"""


def perceived_distances(
    centers_m: FloatArray, radii_m: FloatArray, scene: SceneTable, target: int | None, held: int | None
) -> PerceivedDistances:
    """Return the distances in one frame from the gripper's spheres: centres (m, 3), radii (m,).

    target, held: indices of objects, or None.
    """
    wanted = target if target != held else None
    objects, reach_m, distances_m = scene.objects, _FIRST_REACH_M, np.full(len(scene.objects.names), np.inf)
    # No object within the reach is missed, so the search can end once both are found.
    while reach_m <= _FARTHEST_M:
        distances_m = object_distances(centers_m, radii_m, scene, reach_m)
        for index in np.flatnonzero(np.isfinite(distances_m)):
            if index == held or objects.roles[index] is Role.SUPPORT:
                distances_m[index] = np.inf
        if np.isfinite(distances_m).any() and (wanted is None or np.isfinite(distances_m[wanted])):
            break
        reach_m *= 2.0
    if not np.isfinite(distances_m).any():
        return PerceivedDistances()
    nearest = int(np.argmin(distances_m))
    target_m = None if wanted is None or not np.isfinite(distances_m[wanted]) else float(distances_m[wanted])
    return PerceivedDistances(objects.names[nearest], float(distances_m[nearest]), target_m)
