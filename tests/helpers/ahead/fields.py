"""Fields of small grippers in small scenes, for the tests of what is ahead."""

from typing import Any

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.field import Ahead, Along, Field
from robot_side.ahead.find import OBSTACLE, PASSED_OVER, TARGET
from robot_side.ahead.scene_table import scene_table
from robot_side.arm.port import GripperPose
from robot_side.objects.perceived import PerceivedObjects, Role
from tests.helpers.gripper_poses import free_pose

AHEAD = np.array([0.0, 0.0, 1.0])
REACH_M = 0.15
RADIUS_M = 0.008
"""Of a fingertip's sphere."""
STANDING = {Role.TARGET: TARGET, Role.IGNORED: PASSED_OVER}


def ball_pose(radius_m: float = RADIUS_M, **placed: Any) -> GripperPose:
    """One sphere, about the tool's own point."""
    return free_pose([[0.0, 0.0, 0.0]], [radius_m], **placed)


def along(
    direction: FloatArray = AHEAD,
    inflated_m: float = 0.0,
    *,
    variance_m2: float = 0.0,
    quantile: float = 0.0,
    reach_m: float = REACH_M,
) -> Along:
    """A direction; `inflated_m` is the D_σ of every sphere where nothing varies."""
    return Along(np.ascontiguousarray(direction), inflated_m, variance_m2, quantile, reach_m)


def look(
    pose: GripperPose,
    objects: PerceivedObjects,
    ahead: Along,
    *,
    standing: list[int] | None = None,
    widest_m: float = np.inf,
    by: Ahead | None = None,
) -> Field:
    """The field, by tables of its own unless `by` says whose; what objects are follows from their roles."""
    if standing is None:
        standing = [STANDING.get(role, OBSTACLE) for role in objects.roles]
    looking = by or Ahead(np.zeros(pose.tool_jacobian.shape[1]))
    return looking.look(pose, scene_table(objects), np.array(standing, dtype=np.int64), ahead, widest_m)


def ways_of(pose: GripperPose, objects: PerceivedObjects, ahead: Along) -> FloatArray:
    """The eight ways (8,) at which the strengths begin."""
    return look(pose, objects, ahead).fast_m
