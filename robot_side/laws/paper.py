"""The paper's own law (§4.2), for comparison. Every sphere is enlarged by D_incr of eq. 10 in all directions.

The stiffness is s = min(1, V / (f Σ_i V_i)) at every travel. V_i is the volume of the enlarged sphere i, f a setting.

Directed (§2: stiffness "corresponds to the direction of the detected objects"): for R2, V = Σ_ij V_ij max(0, û·n_ij),
with V_ij the overlap of sphere i with object j, n_ij the unit vector towards it, and û R2's direction; for L2 the same
with -û. Towards the target, D_incr of a finger's sphere is at most half the gap between the fingers (§3.4).
Isotropic, as printed: V = Σ_ij V_ij for both triggers, and no limit by the gap. D_incr includes the delay (eq. 8).
Objects whose positions are less certain have a larger D_incr; what each group of them takes of f Σ_i V_i adds up.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.around import Around
from common.protocol.view_messages import EnlargementTerms
from common.skipped import Part
from robot_side.arm.port import GripperPose
from robot_side.enlargement.distance import plain_enlargements_m
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.field.object_class import TARGET
from robot_side.field.object_errors import Alike, alike, largest_errors, object_errors
from robot_side.field.total_overlap import overlaps_along
from robot_side.laws.classes import classes_of
from robot_side.laws.inputs import LawInputs, everything_but_held
from robot_side.tick.explained import Trigger
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

PERIOD_S: Final = 0.01
_SPHERE: Final = 4.0 / 3.0 * math.pi


class PaperLaw:
    """The paper's law. It computes a result every PERIOD_S and returns this result in between."""

    def __init__(self, inputs: LawInputs, *, isotropic: bool = False) -> None:
        """Take the arm, the errors and the surroundings of a run. isotropic: both triggers alike, as printed."""
        self._ticks = self.looked = 0
        self.limited = 0
        """Number of results in which the gap between the fingers has limited D_incr"""
        self._inputs = inputs
        self._uncertainty = inputs.uncertainty
        self._isotropic = isotropic
        self._once: tuple[float, EnlargementTerms] | None = None
        """D_incr that was computed once, with its terms"""
        self._sensed: tuple[float, Sensed] | None = None

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the fields of one tick. The overlap is computed again at most a hundred times a second."""
        self._ticks += 1
        if self._sensed is None or now_s - self._sensed[0] >= PERIOD_S - 1e-9:
            self._sensed = now_s, self._look(situation)
        return self._sensed[1]

    def expect(self, probability: float) -> None:
        """Set the probability P of eq. 10; ConfigurationError outside (0, 1)."""
        self._uncertainty, self._once = replace(self._uncertainty, probability=probability), None

    def around(self, pose: GripperPose) -> Around | None:
        """Return None: the plain law has no onset distances."""
        del pose
        return None

    def summary(self) -> dict[str, int]:
        """Return how often the overlap was computed during the run, and how often the gap limited D_incr."""
        return {"looks": self.looked, "limited_by_gap": self.limited}

    def skipped(self) -> dict[str, Part]:
        """Return the ticks in which the overlap was computed, of all ticks."""
        return {"looks": Part(self.looked, self._ticks)}

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> EnlargementTerms:
        """Return the terms of D_incr; both triggers have the same.

        The terms are those of the sphere with the largest D_incr; its displacement is |v| t_d.
        """
        del trigger, sensed
        of_objects = object_errors(situation.objects, self._uncertainty)
        return self._enlarged(situation, largest_errors(of_objects, self._uncertainty))[1]

    def _enlarged(self, situation: Situation, camera: tuple[float, float]) -> tuple[FloatArray, EnlargementTerms]:
        """Return D_incr (m,) of the spheres, and the terms of the largest.

        camera: unseen motion in m and σ_c² in m² of the objects.
        """
        jacobians, once = situation.pose.sphere_jacobians, self._inputs.paper.enlargement == "once"
        if self._once is not None:
            return np.full(len(jacobians), self._once[0]), self._once[1]
        velocities_m_s = jacobians @ situation.joint_velocities_rad_s
        if once:
            full_speed_m_s = self._inputs.motion.trigger_speed_m_s * situation.pose.tool_rotation[:, 2]
            velocities_m_s = np.broadcast_to(full_speed_m_s, (len(jacobians), 3))
        uncertainty, covariances = self._uncertainty, position_covariance(jacobians, self._inputs.encoder_sigma_rad)
        by_m = plain_enlargements_m(uncertainty, covariances, velocities_m_s, situation.loop_age_s, camera)
        largest = int(by_m.argmax())
        displacement_m = float(np.linalg.norm(velocities_m_s[largest])) * situation.loop_age_s
        terms = EnlargementTerms(
            sigma_m=float(by_m[largest]) - displacement_m,
            mean_m=camera[0] + math.hypot(*uncertainty.kinematic_mean_m) + math.hypot(*uncertainty.camera_mean_m),
            kinematic_sd_m=math.sqrt(float(np.trace(covariances[largest]))),
            camera_sd_m=math.sqrt(camera[1]),
            prediction_sd_m=0.0,
            quantile=uncertainty.quantile,
            loop_age_s=situation.loop_age_s,
            displacement_m=displacement_m,
        )
        if once and situation.loop_age_settled:
            self._once = float(by_m[largest]), terms
        return by_m, terms

    def _look(self, situation: Situation) -> Sensed:
        self.looked += 1
        objects, uncertainty, inputs = situation.objects, self._uncertainty, self._inputs
        classes = everything_but_held(situation) if self._isotropic else classes_of(objects, situation.held).usual
        of_objects = object_errors(objects, uncertainty)
        groups = alike(of_objects, classes, uncertainty)
        if inputs.paper.enlargement == "once":
            groups = [Alike(*largest_errors(of_objects, uncertainty), classes)]
        l2, r2, largest_m, limits = 0.0, 0.0, 0.0, False
        for unseen_m, variance_m2, some in groups:
            by_m, _ = self._enlarged(situation, (unseen_m, variance_m2))
            behind, ahead, limited = self._shares(situation, by_m, some)
            l2, r2, largest_m, limits = l2 + behind, r2 + ahead, max(largest_m, float(by_m.max())), limits or limited
        self.limited += limits
        return inputs.sensed(situation, l2=min(1.0, l2), r2=min(1.0, r2), enlargement_m=largest_m)

    def _shares(self, situation: Situation, by_m: FloatArray, classes: IntArray) -> tuple[float, float, bool]:
        """Return V / (f Σ_i V_i) of L2 and of R2, and whether the gap limits D_incr, which is `by_m` (m,)."""
        pose, inputs = situation.pose, self._inputs
        radii_m = pose.sphere_radii_m + by_m
        full_m3 = inputs.paper.share * _SPHERE * float((radii_m**3).sum())
        if self._isotropic:
            share = inputs.total_overlap_m3(situation, by_m, classes=classes) / full_m3
            return share, share, False
        to_target_m = radii_m
        if situation.gap_m is not None:
            widest_m = 0.5 * max(situation.gap_m, 0.0)
            to_target_m = np.where(pose.sphere_on_finger, pose.sphere_radii_m + np.minimum(by_m, widest_m), radii_m)
        spheres = np.concatenate([pose.sphere_centers_m, radii_m[:, None]], axis=1)
        table = inputs.surroundings.see(situation.objects)
        found = overlaps_along(spheres, to_target_m, pose.tool_rotation[:, 2], table, classes)
        limited = (to_target_m < radii_m).any() and (classes == TARGET).any()
        return found.behind_m3 / full_m3, found.ahead_m3 / full_m3, bool(limited)


class MarginLaw(PaperLaw):
    """The paper's law with one enlargement, `law_margin_m`, whatever errors, speed and delay are, for comparison.

    A warning by distance alone does this. With the mean enlargement of another law it compares to that one.
    """

    def _enlarged(self, situation: Situation, camera: tuple[float, float]) -> tuple[FloatArray, EnlargementTerms]:
        """Return the margin for each sphere (m,), and its terms: a mean, and nothing that varies."""
        del camera
        margin_m = self._inputs.paper.margin_m
        terms = EnlargementTerms(margin_m, margin_m, 0.0, 0.0, 0.0, 0.0, situation.loop_age_s, 0.0)
        return np.full(len(situation.pose.sphere_radii_m), margin_m), terms
