"""Fields of small grippers in small scenes, for tests of contact distances."""

from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray, IntArray
from common.roles import Role
from feelahead.lab.reference.onsets_by_definition import Judged, defined_onsets
from robot_side.arm.port import GripperPose
from robot_side.field.field import Ahead, Along, Field
from robot_side.field.object_class import OBSTACLE, SKIPPED, TARGET
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.gripper_poses import free_pose

AHEAD = np.array([0.0, 0.0, 1.0])
REACH_M = 0.15
RADIUS_M = 0.008
"""Radius of a fingertip's sphere."""
EQUAL_M = 1e-4
"""Tolerance of contact distances."""
CLASSES = {Role.TARGET: TARGET, Role.IGNORED: SKIPPED}


def ball_pose(radius_m: float = RADIUS_M, **placed: Any) -> GripperPose:
    """Return one sphere about the tool's own point."""
    return free_pose([[0.0, 0.0, 0.0]], [radius_m], **placed)


def along(
    direction: FloatArray = AHEAD,
    inflated_m: float = 0.0,
    *,
    variance_m2: float = 0.0,
    quantile: float = 0.0,
    reach_m: float = REACH_M,
) -> Along:
    """Return a direction; `inflated_m` is the D_σ of every sphere if nothing varies."""
    return Along(np.ascontiguousarray(direction), inflated_m, variance_m2, quantile, reach_m)


def _classes(objects: PerceivedObjects, given: list[int] | None) -> IntArray:
    found = [CLASSES.get(role, OBSTACLE) for role in objects.roles] if given is None else given
    return np.array(found, dtype=np.int64)


def look(
    pose: GripperPose,
    objects: PerceivedObjects,
    ahead: Along,
    *,
    classes: list[int] | None = None,
    widest_m: float = np.inf,
    by: Ahead | None = None,
) -> Field:
    """Compute the field, by new tables unless `by` gives some; classes follow from the objects' roles."""
    looking = by or Ahead(np.zeros(pose.tool_jacobian.shape[1]))
    return looking.look(pose, scene_table(objects), _classes(objects, classes), ahead, widest_m)


def ways_of(pose: GripperPose, objects: PerceivedObjects, ahead: Along) -> FloatArray:
    """Return the distances (8,) at which the strengths begin."""
    return look(pose, objects, ahead).fast_m


def judged(pose: GripperPose, objects: PerceivedObjects, ahead: Along, **how: Any) -> Judged:
    """Compare the distances of such a look with their definition; `how` as `look` takes it."""
    looking: Ahead = how.setdefault("by", Ahead(np.zeros(pose.tool_jacobian.shape[1])))
    found = look(pose, objects, ahead, **how)
    classes, widest_m = _classes(objects, how.get("classes")), how.get("widest_m", np.inf)
    defined = defined_onsets(pose, objects, classes, ahead, widest_m, looking.encoder_sigma_rad)
    assert found.sigma_m == pytest.approx(defined.sigma_m, abs=1e-12)
    return defined.judge(found.onsets_m, ahead.reach_m)
