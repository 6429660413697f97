"""Terms of the enlargement and overlap with each object, for display. They are computed on request only."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.view_messages import EnlargementTerms
from robot_side.arm.port import GripperPose
from robot_side.field.total_overlap import total_overlap_m3
from robot_side.laws.prospect import Asked
from robot_side.surroundings.scene_table import SceneTable
from robot_side.tick.explained import Overlaps, TriggerExplained
from robot_side.tick.situation import Situation


def explained(
    situation: Situation, asked: Asked, displacement_m: float, encoder_sigma_rad: FloatArray, scene: SceneTable
) -> TriggerExplained:
    """Return the terms of eq. 8-10 for the sphere with the largest D_σ, and the overlaps of the gripper moved by δ.

    asked: the look that is explained, from the present pose. displacement_m: δ. encoder_sigma_rad (n,): σ_θ.
    """
    pose, along = situation.pose, asked.along
    # ûᵀ J diag(σ_θ²) Jᵀ û of each sphere (eq. 5)
    kinematic_m2 = np.square(along.direction @ pose.sphere_jacobians) @ np.square(encoder_sigma_rad)
    variance_m2 = kinematic_m2 + along.variance_m2 + along.variance_along_m2
    mean_m = along.mean_m + along.mean_along_m
    sigmas_m = np.maximum(mean_m + along.quantile * np.sqrt(variance_m2), 0.0)
    largest = int(sigmas_m.argmax())
    terms = EnlargementTerms(
        sigma_m=float(sigmas_m[largest]),
        mean_m=float(mean_m),
        kinematic_sd_m=math.sqrt(kinematic_m2[largest]),
        camera_sd_m=math.sqrt(along.variance_m2),
        prediction_sd_m=math.sqrt(along.variance_along_m2),
        quantile=along.quantile,
        loop_age_s=situation.loop_age_s,
        displacement_m=displacement_m,
    )
    spheres = moved_and_inflated(pose, displacement_m * along.direction, sigmas_m)
    return TriggerExplained(terms, overlaps_by_object(spheres, scene, asked.classes))


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
