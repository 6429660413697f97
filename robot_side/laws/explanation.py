"""Terms of the enlargement and overlap with each object, for display. They are computed on request only."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.view_messages import EnlargementTerms
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.inflation import explain_inflation
from robot_side.field.total_overlap import total_overlap_m3
from robot_side.surroundings.scene_table import SceneTable
from robot_side.tick.explained import Overlaps
from robot_side.tick.situation import Situation


def enlargement_terms(
    situation: Situation,
    along: Along,
    encoder_sigma_rad: FloatArray,
    displacement_m: float,
) -> tuple[EnlargementTerms, FloatArray]:
    """Return the terms of eq. 8-10 for the sphere with the largest D_σ, and D_σ of all spheres (m,).

    encoder_sigma_rad (n,).
    """
    pose, count = situation.pose, len(situation.pose.sphere_radii_m)
    kinematic_m2, sigma_m = np.empty(count), np.empty(count)
    explain_inflation(
        *(np.ascontiguousarray(pose.sphere_centers_m), pose.tool_position_m, np.ascontiguousarray(pose.tool_jacobian)),
        *(encoder_sigma_rad**2, along.direction, along.mean_m, along.variance_m2),
        *(along.mean_along_m, along.variance_along_m2, along.quantile, kinematic_m2, sigma_m),
    )
    largest = int(sigma_m.argmax())
    terms = EnlargementTerms(
        sigma_m=float(sigma_m[largest]),
        mean_m=float(along.mean_m + along.mean_along_m),
        kinematic_sd_m=float(np.sqrt(kinematic_m2[largest])),
        camera_sd_m=math.sqrt(along.variance_m2),
        prediction_sd_m=math.sqrt(along.variance_along_m2),
        quantile=along.quantile,
        loop_age_s=float(situation.loop_age_s),
        displacement_m=float(displacement_m),
    )
    return terms, sigma_m


def overlaps_by_object(spheres: FloatArray, scene: SceneTable, classes: IntArray) -> Overlaps:
    """Return Σ_i V_ij of each object j that the spheres i (m, 4) overlap, without objects of the class SKIPPED.

    classes (k,).
    """
    found_m3 = np.zeros(len(classes))
    total_overlap_m3(spheres, scene, classes, of_objects_m3=found_m3)
    return {int(thing): float(found_m3[thing]) for thing in np.flatnonzero(found_m3)}


def moved_and_inflated(pose: GripperPose, moved_m: FloatArray, by_m: FloatArray) -> FloatArray:
    """Return the gripper's spheres (m, 4), displaced by moved_m (3,), their radii increased by by_m (m,)."""
    return np.concatenate([pose.sphere_centers_m + moved_m, (pose.sphere_radii_m + by_m)[:, None]], axis=1)
