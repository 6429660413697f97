"""The paper's own law (§4.2), for comparison. Every sphere is enlarged by D_incr of eq. 10 in all directions.

The stiffness is s = min(1, Σ_ij V_ij / (f Σ_i V_i)) for both triggers and at every travel. V_ij is the overlap of the
enlarged sphere i with object j, V_i the sphere's volume. D_incr includes the delay (eq. 8).
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.around import Around
from common.protocol.view_messages import EnlargementTerms
from robot_side.arm.port import GripperPose
from robot_side.enlargement.distance import plain_enlargements_m
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.laws.explanation import moved_and_inflated, overlaps_by_object
from robot_side.laws.inputs import LawInputs, everything_but_held
from robot_side.tick.explained import Trigger, TriggerExplained
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

REFERENCE_SHARE: Final = 0.05
"""f, the share of the spheres' volume that must overlap for full strength. The paper gives no value. A smaller f gives
full strength earlier, but also for objects beside and behind."""
PERIOD_S: Final = 0.01


class PaperLaw:
    """The paper's law. It computes a result every PERIOD_S and returns this result in between."""

    def __init__(self, inputs: LawInputs) -> None:
        """Take the arm, the errors and the surroundings of a run."""
        self.looked = 0
        self._inputs = inputs
        self._uncertainty = inputs.uncertainty
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
        table = self._inputs.surroundings.see(situation.objects)
        return TriggerExplained(terms, overlaps_by_object(spheres, table, everything_but_held(situation)))

    def _enlargements(self, situation: Situation) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return D_incr (m,), position covariances (m, 3, 3) and velocities (m, 3) of the spheres."""
        jacobians = situation.pose.sphere_jacobians
        covariances = position_covariance(jacobians, self._inputs.encoder_sigma_rad)
        velocities_m_s = jacobians @ situation.joint_velocities_rad_s
        enlargements_m = plain_enlargements_m(self._uncertainty, covariances, velocities_m_s, situation.loop_age_s)
        return enlargements_m, covariances, velocities_m_s

    def _look(self, situation: Situation) -> Sensed:
        self.looked += 1
        enlargement_m, _, _ = self._enlargements(situation)
        overlap_m3 = self._inputs.overlap_m3(situation, enlargement_m)
        radii_m = situation.pose.sphere_radii_m + enlargement_m
        stiffness = min(1.0, overlap_m3 / (REFERENCE_SHARE * 4.0 / 3.0 * np.pi * float((radii_m**3).sum())))
        figures = {"enlargement_m": float(enlargement_m.max()), "overlap_m3": overlap_m3}
        return self._inputs.sensed(situation, l2=stiffness, r2=stiffness, **figures)
