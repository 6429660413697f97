"""What the enlargement is made of and what overlaps, for people who look; worked out only when asked for."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.view_messages import EnlargementTerms
from robot_side.ahead.field import Along
from robot_side.ahead.find import PASSED_OVER
from robot_side.ahead.law import Sensed, Situation
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import Tables
from robot_side.ahead.total_overlap import total_overlap_m3
from robot_side.arm.port import GripperPose

Trigger = Literal["l2", "r2"]
Overlaps = dict[int, float]
"""By object, m³; only where there is any."""


@dataclass(frozen=True)
class TriggerExplained:
    """Of one trigger."""

    terms: EnlargementTerms
    overlaps_m3: Overlaps
    """Of the gripper inflated by D_σ and moved by the robot side's δ (eq. 11-12)"""


class Explains(Protocol):
    """A law that can say why."""

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> TriggerExplained:
        """One trigger, as `sensed` was found in `situation`."""
        ...


def enlargement_terms(
    situation: Situation,
    along: Along,
    encoder_sigma_rad: FloatArray,
    camera_sd_m: float,
    prediction_sd_m: float,
    displacement_m: float,
) -> tuple[EnlargementTerms, FloatArray]:
    """What eq. 8-10 are made of for the sphere with the largest D_σ; and D_σ of all (m,). encoder_sigma_rad (n,)."""
    pose = situation.pose
    linear, angular = pose.tool_jacobian[:3], pose.tool_jacobian[3:]
    # û·(v + ω × r) for each joint, as `find` has it.
    lever = pose.sphere_centers_m - pose.tool_position_m
    parts = along.direction @ linear + lever @ np.cross(along.direction, angular.T).T
    kinematic = parts**2 @ encoder_sigma_rad**2
    sigma_m = np.maximum(0.0, along.mean_m + along.quantile * np.sqrt(kinematic + along.variance_m2))
    largest = int(sigma_m.argmax())
    terms = EnlargementTerms(
        sigma_m=float(sigma_m[largest]),
        mean_m=float(along.mean_m),
        kinematic_sd_m=float(np.sqrt(kinematic[largest])),
        camera_sd_m=camera_sd_m,
        prediction_sd_m=float(prediction_sd_m),
        quantile=along.quantile,
        loop_age_s=float(situation.loop_age_s),
        displacement_m=float(displacement_m),
    )
    return terms, sigma_m


def overlaps_by_object(spheres: FloatArray, scene: SceneTable, standing: IntArray, tables: Tables) -> Overlaps:
    """Σ_i V_ij of each object j that the spheres (m, 4) overlap, but for those passed over; standing (k,)."""
    low, high = (spheres[:, :3] - spheres[:, 3:]).min(axis=0), (spheres[:, :3] + spheres[:, 3:]).max(axis=0)
    middle, around = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    bounds = scene.object_bounds
    near = np.linalg.norm(bounds[:, :3] - middle, axis=1) <= around + bounds[:, 3]
    found: Overlaps = {}
    for thing in np.flatnonzero(near & (standing != PASSED_OVER)).tolist():
        alone = np.full_like(standing, PASSED_OVER)
        alone[thing] = standing[thing]
        if (volume_m3 := total_overlap_m3(spheres, scene, alone, tables)) > 0.0:
            found[thing] = volume_m3
    return found


def moved_and_inflated(pose: GripperPose, moved_m: FloatArray, by_m: FloatArray) -> FloatArray:
    """The gripper's spheres (m, 4): moved by (3,), inflated by (m,)."""
    return np.concatenate([pose.sphere_centers_m + moved_m, (pose.sphere_radii_m + by_m)[:, None]], axis=1)
