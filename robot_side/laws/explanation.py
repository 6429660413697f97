"""Terms of the enlargement D_σ along one trigger, for display. They are computed on request only."""

import math

import numpy as np

from common.arrays import FloatArray
from common.protocol.view_messages import EnlargementTerms
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.tick.situation import Situation


def explained(
    situation: Situation, along: Along, displacement_m: float, encoder_sigma_rad: FloatArray
) -> EnlargementTerms:
    """Return the terms of eq. 8-10 for the sphere with the largest D_σ, and for the objects' largest errors.

    along: that of a look from the present pose. displacement_m: δ. encoder_sigma_rad (n,): σ_θ.
    """
    sigmas_m, kinematic_m2 = enlargements_m(situation.pose, along, encoder_sigma_rad)
    largest = int(sigmas_m.argmax())
    return EnlargementTerms(
        sigma_m=float(sigmas_m[largest]),
        mean_m=float(along.mean_m + along.unseen_m + along.mean_along_m),
        kinematic_sd_m=math.sqrt(kinematic_m2[largest]),
        camera_sd_m=math.sqrt(along.variance_m2),
        prediction_sd_m=math.sqrt(along.variance_along_m2),
        quantile=along.quantile,
        loop_age_s=situation.loop_age_s,
        displacement_m=displacement_m,
    )


def enlargements_m(pose: GripperPose, along: Along, encoder_sigma_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return D_σ (m,) of each sphere, and the variance (m,) in m² of the arm's estimate: ûᵀ J diag(σ_θ²) Jᵀ û.

    The errors of objects are the largest, those of `along` itself.
    """
    kinematic_m2 = np.square(along.direction @ pose.sphere_jacobians) @ np.square(encoder_sigma_rad)
    variance_m2 = kinematic_m2 + along.variance_m2 + along.variance_along_m2
    mean_m = along.mean_m + along.unseen_m + along.mean_along_m
    return np.maximum(mean_m + along.quantile * np.sqrt(variance_m2), 0.0), kinematic_m2
