"""Gripper inflated by D_σ and moved by δ (eq. 8-10), and the volume that it shares with the objects, under any law.

These are figures for people: no law takes them.
"""

from dataclasses import replace

import numpy as np

from common.arrays import FloatArray
from robot_side.field.object_errors import alike
from robot_side.field.shared_volume import shared_volume_m3
from robot_side.laws.classes import Classes, classes_of
from robot_side.laws.explanation import enlargements_m
from robot_side.laws.inputs import LawInputs
from robot_side.laws.prospect import Assumed, prospect
from robot_side.tick.explained import Overlaps, Trigger
from robot_side.tick.sensed import L2, R2
from robot_side.tick.situation import Situation


class EnlargedGripper:
    """Owner of the errors that enlarge the gripper."""

    def __init__(self, inputs: LawInputs) -> None:
        """inputs: what the run's law is made from."""
        self._inputs = inputs
        self._assumed = Assumed(inputs.uncertainty, inputs.limits, inputs.motion)
        self._classes: Classes | None = None

    def expect(self, probability: float) -> None:
        """Set the probability P of eq. 10; ConfigurationError outside (0, 1)."""
        uncertainty = replace(self._assumed.uncertainty, probability=probability)
        self._assumed = replace(self._assumed, uncertainty=uncertainty)

    def overlaps_m3(self, trigger: Trigger, situation: Situation) -> Overlaps:
        """Return the volumes shared with objects, for the gripper enlarged along one trigger (see `Overlaps`)."""
        found_m3 = np.zeros(len(situation.objects.names))
        self._overlap_m3(R2 if trigger == "r2" else L2, situation, found_m3)
        return {int(thing): float(found_m3[thing]) for thing in np.flatnonzero(found_m3)}

    def overlap_m3(self, situation: Situation) -> float:
        """Return the volume shared with all objects, along the trigger that leads: at rest R2.

        Space within two objects counts once, unless the gripper is enlarged differently for them.
        """
        return self._overlap_m3(R2 if _ahead_m_s(situation) >= 0.0 else L2, situation, np.empty(0))

    def _overlap_m3(self, side: int, situation: Situation, of_objects_m3: FloatArray) -> float:
        inputs, pose, objects, ahead_m_s = self._inputs, situation.pose, situation.objects, _ahead_m_s(situation)
        if self._classes is None or not self._classes.fit(objects, situation.held):
            self._classes = classes_of(objects, situation.held)
        classes = self._classes.usual
        found = prospect(side, situation, ahead_m_s, classes, self._assumed)
        along, under_way_m_s = found.asked.along, ahead_m_s if side == R2 else -ahead_m_s
        # Commands under way from an operator who has echoed nothing are unknown: full speed is the worst case.
        if not situation.loop_age_known:
            under_way_m_s = max(under_way_m_s, found.able.full_speed_m_s)
        centers_m = pose.sphere_centers_m + under_way_m_s * situation.loop_age_s * along.direction
        table, found_m3 = inputs.surroundings.see(objects), 0.0
        for unseen_m, variance_m2, some in alike(along.of_objects, classes, self._assumed.uncertainty):
            towards = replace(along, unseen_m=unseen_m, variance_m2=variance_m2)
            sigmas_m, _ = enlargements_m(pose, towards, inputs.encoder_sigma_rad)
            spheres = np.concatenate([centers_m, (pose.sphere_radii_m + sigmas_m)[:, None]], axis=1)
            found_m3 += shared_volume_m3(spheres, table, some, of_objects_m3)
        return found_m3


def _ahead_m_s(situation: Situation) -> float:
    """Return the tool's speed along its approach axis, along which R2 advances."""
    pose = situation.pose
    return float(pose.tool_rotation[:, 2] @ (pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s))
