"""Single looks of small grippers in small scenes, for tests of contact distances and onset distances."""

from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray, IntArray
from common.roles import Role
from feelahead.lab.reference.onsets_by_definition import Judged, defined_onsets
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.field import Ahead, Field
from robot_side.field.object_class import OBSTACLE, SKIPPED, TARGET
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.gripper_poses import free_pose

AHEAD = np.array([0.0, 0.0, 1.0])
REACH_M = 0.15
RADIUS_M = 0.008
"""Radius of a fingertip's sphere."""
EQUAL_M = 1e-4
"""Tolerance, in metres, for two contact distances that should be equal."""
CLASSES = {Role.TARGET: TARGET, Role.IGNORED: SKIPPED}


def ball_pose(radius_m: float = RADIUS_M, **placed: Any) -> GripperPose:
    """Return the pose of a gripper that is one sphere, centred on the tool point."""
    return free_pose([[0.0, 0.0, 0.0]], [radius_m], **placed)


def along(
    direction: FloatArray = AHEAD,
    inflated_m: float = 0.0,
    *,
    variance_m2: float = 0.0,
    quantile: float = 0.0,
    reach_m: float = REACH_M,
) -> Along:
    """Return the direction and uncertainty of a look. Without variances, D_σ of every sphere is `inflated_m`."""
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
    """Compute the field of one look. Without `classes`, the objects' classes follow from their roles.

    by: gives the encoders' errors and the memory to use; without it, encoders have no errors and the memory is new.
    """
    looking = by or Ahead(np.zeros(pose.tool_jacobian.shape[1]))
    return looking.look(pose, scene_table(objects), _classes(objects, classes), ahead, widest_m)


def ways_of(pose: GripperPose, objects: PerceivedObjects, ahead: Along) -> FloatArray:
    """Return the eight onset distances (8,) of one look, for fast zones."""
    return look(pose, objects, ahead).fast_m


def judged(pose: GripperPose, objects: PerceivedObjects, ahead: Along, **how: Any) -> Judged:
    """Compare the onset distances of one look with their definition. how: further arguments of `look`."""
    looking: Ahead = how.setdefault("by", Ahead(np.zeros(pose.tool_jacobian.shape[1])))
    found = look(pose, objects, ahead, **how)
    classes, widest_m = _classes(objects, how.get("classes")), how.get("widest_m", np.inf)
    defined = defined_onsets(pose, objects, classes, ahead, widest_m, looking.encoder_sigma_rad)
    assert found.sigma_m == pytest.approx(defined.sigma_m, abs=1e-12)
    return defined.judge(found.onsets_m, ahead.reach_m)
