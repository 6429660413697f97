"""What a look ahead of a gripper costs, as its spheres are many or few."""

from collections.abc import Callable

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.field import Ahead, Along
from robot_side.ahead.find import OBSTACLE
from robot_side.ahead.scene_table import scene_table
from robot_side.arm.port import GripperPose
from robot_side.compiled.warm_up import warm_up
from robot_side.objects.perceived import PerceivedObjects, Role

_FREE_M, _REACH_M = 0.08, 0.4
_HALF_SIZES_M = (0.5, 0.5, 0.01)
_SPREAD_M = 0.003
_QUANTILE = 2.326
"""Of P = 0.99."""


def field_cost_us(pose: GripperPose, looks: int, now_s: Callable[[], float]) -> float:
    """The least processor time of `looks` looks along the approach at a wall 80 mm before the foremost sphere."""
    axis = pose.tool_rotation[:, 2]
    front_m = ((pose.sphere_centers_m - pose.tool_position_m) @ axis + pose.sphere_radii_m).max()
    wall = scene_table(_wall(pose.tool_position_m + (front_m + _FREE_M + _HALF_SIZES_M[2]) * axis, pose.tool_rotation))
    ahead = Ahead(np.full(pose.tool_jacobian.shape[1], 1e-4))
    along = Along(np.ascontiguousarray(axis), 0.0, _SPREAD_M**2, _QUANTILE, _REACH_M)
    standing = np.full(1, OBSTACLE, dtype=np.int64)
    warm_up()
    best_s = np.inf
    for _ in range(looks):
        began_s = now_s()
        ahead.look(pose, wall, standing, along)
        best_s = min(best_s, now_s() - began_s)
    return 1e6 * float(best_s)


def _wall(center_m: FloatArray, rotation: FloatArray) -> PerceivedObjects:
    none, no_object = np.empty((0, 3)), np.empty(0, dtype=np.int64)
    return PerceivedObjects(
        time_s=0.0,
        names=("wall",),
        roles=(Role.OBSTACLE,),
        sphere_centers_m=none,
        sphere_radii_m=np.empty(0),
        sphere_object=no_object,
        box_centers_m=center_m[None],
        box_rotations=np.ascontiguousarray(rotation[None]),
        box_half_sizes_m=np.array([_HALF_SIZES_M]),
        box_object=np.zeros(1, dtype=np.int64),
        tetrahedron_vertices_m=np.empty((0, 4, 3)),
        tetrahedron_object=no_object,
        half_space_normals=none,
        half_space_offsets_m=np.empty(0),
        half_space_object=no_object,
    )
