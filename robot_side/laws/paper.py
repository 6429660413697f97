"""The paper's own law (§4.2), for comparison. Every sphere is enlarged by D_incr of eq. 10 in all directions.

The stiffness is s = min(1, Σ_ij V_ij / (f Σ_i V_i)) for both triggers and at every travel. V_ij is the overlap of the
enlarged sphere i with object j, V_i the sphere's volume. D_incr includes the delay (eq. 8).
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.around import Around
from common.protocol.uniform_field import FAR_M, STRENGTHS, uniform_field
from common.protocol.view_messages import EnlargementTerms
from common.roles import Role
from robot_side.arm.ability import JointLimits, along_approach
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.enlargement.distance import Uncertainty, plain_enlargements_m
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.field.object_class import OBSTACLE, SKIPPED
from robot_side.field.total_overlap import total_overlap_m3
from robot_side.laws.explanation import moved_and_inflated, overlaps_by_object
from robot_side.surroundings.surroundings import Surroundings
from robot_side.tick.explained import Trigger, TriggerExplained
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

REFERENCE_SHARE: Final = 0.05
"""f, the share of the spheres' volume that must overlap for full strength. The paper gives no value. A smaller f gives
full strength earlier, but also for objects beside and behind."""
PERIOD_S: Final = 0.01


class PaperLaw:
    """The paper's law. It computes a result every PERIOD_S and returns this result in between."""

    def __init__(
        self,
        uncertainty: Uncertainty,
        encoder_sigma_rad: FloatArray,
        limits: JointLimits,
        motion: ToolMotionSettings,
        surroundings: Surroundings | None = None,
    ) -> None:
        """encoder_sigma_rad (n,): σ_θ of eq. 3. surroundings: owner of the perceived scene; a new one by default."""
        self.surroundings = surroundings or Surroundings()
        self.looked = 0
        self._uncertainty = uncertainty
        self._encoder_sigma_rad = encoder_sigma_rad
        self._limits = limits
        self._motion = motion
        self._sensed: tuple[float, Sensed] | None = None

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the fields of one tick. The overlap is computed again at most a hundred times a second."""
        if self._sensed is None or now_s - self._sensed[0] >= PERIOD_S - 1e-9:
            self._sensed = now_s, self._look(situation)
        return self._sensed[1]

    def expect(self, probability: float) -> None:
        """Set the probability P of eq. 10; ConfigurationError outside (0, 1)."""
        self._uncertainty = replace(self._uncertainty, probability=probability)

    def around(self, pose: GripperPose) -> Around | None:
        """Return None: the plain law has no onset distances."""
        del pose
        return None

    def summary(self) -> dict[str, int]:
        """Return how often the overlap was computed during the run."""
        return {"fields": self.looked}

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> TriggerExplained:
        """Return the terms of D_incr and the overlaps with each object; both triggers have the same.

        The terms are those of the sphere with the largest D_incr; its displacement is |v| t_d.
        """
        del trigger, sensed
        enlargement_m, covariances, velocities = self._enlargements(situation)
        largest = int(enlargement_m.argmax())
        displacement_m = float(np.linalg.norm(velocities[largest])) * situation.loop_age_s
        uncertainty = self._uncertainty
        terms = EnlargementTerms(
            sigma_m=float(enlargement_m[largest]) - displacement_m,
            mean_m=math.hypot(*uncertainty.kinematic_mean_m) + math.hypot(*uncertainty.camera_mean_m),
            kinematic_sd_m=math.sqrt(float(np.trace(covariances[largest]))),
            camera_sd_m=uncertainty.camera_sd_m,
            prediction_sd_m=0.0,
            quantile=uncertainty.quantile,
            loop_age_s=situation.loop_age_s,
            displacement_m=displacement_m,
        )
        spheres = moved_and_inflated(situation.pose, np.zeros(3), enlargement_m)
        table = self.surroundings.see(situation.objects)
        return TriggerExplained(terms, overlaps_by_object(spheres, table, _classes_of(situation)))

    def _enlargements(self, situation: Situation) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return D_incr (m,), position covariances (m, 3, 3) and velocities (m, 3) of the spheres."""
        jacobians = situation.pose.sphere_jacobians
        covariances = position_covariance(jacobians, self._encoder_sigma_rad)
        velocities_m_s = jacobians @ situation.joint_velocities_rad_s
        enlargements_m = plain_enlargements_m(self._uncertainty, covariances, velocities_m_s, situation.loop_age_s)
        return enlargements_m, covariances, velocities_m_s

    def _look(self, situation: Situation) -> Sensed:
        self.looked += 1
        pose = situation.pose
        enlargement_m, _, _ = self._enlargements(situation)
        radii, classes = pose.sphere_radii_m + enlargement_m, _classes_of(situation)
        spheres = np.concatenate([pose.sphere_centers_m, radii[:, None]], axis=1)
        overlap_m3 = total_overlap_m3(spheres, self.surroundings.see(situation.objects), classes)
        stiffness = min(1.0, overlap_m3 / (REFERENCE_SHARE * 4.0 / 3.0 * np.pi * float((radii**3).sum())))
        able = along_approach(pose, self._limits, self._motion.trigger_speed_m_s)
        felt = uniform_field(round(STRENGTHS * stiffness), able.full_speed_m_s, able.acceleration_m_s2)
        velocity_m_s = pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s
        return Sensed(
            l2=felt,
            r2=felt,
            speed_m_s=float(pose.tool_rotation[:, 2] @ velocity_m_s),
            tool_speed_m_s=float(np.linalg.norm(velocity_m_s)),
            horizon_m=FAR_M,
            enlargement_m=float(enlargement_m.max()),
            overlap_m3=overlap_m3,
        )


def _classes_of(situation: Situation) -> IntArray:
    classes = np.array(
        [SKIPPED if role is Role.IGNORED else OBSTACLE for role in situation.objects.roles], dtype=np.int64
    )
    if situation.held is not None:
        classes[situation.held] = SKIPPED
    return classes
