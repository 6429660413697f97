"""The law "swept": the gripper, inflated by D_σ, is moved along each trigger until it overlaps something (§4.2).

Looks, evaluations of the law along one direction, take turns, about one in a tick: R2, L2, and the stick while it is
deflected. Between looks the tool's motion is subtracted from the onset distances, which is exact for a translation.
The shortest onset distances of the last 0.1 s count: where the gripper just passes an object, encoder noise alone can
switch between no strength and full strength.

While the gripper drifts, turns, or moves its fingers, looks along R2 and L2 are also made from places ahead on its path
(`path`). The path ends where a command sent now has stopped the gripper. An operator side that traces its own sticks
gets a map of onset distances around the gripper instead (`around`). An object that approaches has its contact
distances shortened by its motion until the gripper has stopped.
"""

import math
from dataclasses import replace
from typing import Final, NamedTuple, NoReturn

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from common.protocol.around import LISTS, LONGEST_S, MOST_JOINTS, PROBES, Around
from common.roles import Role
from common.touch_speed import touch_speed_m_s
from robot_side.arm.ability import JointLimits, change_times_s, find_ability
from robot_side.arm.port import GripperPose
from robot_side.arm.resolved_rate import refuse
from robot_side.arm.tool_motion import ToolMotionSettings, full_twists
from robot_side.enlargement.distance import Uncertainty
from robot_side.field.along import Along
from robot_side.field.look import look
from robot_side.field.object_class import OBSTACLE, SKIPPED, TARGET, TOUCHABLE
from robot_side.field.scratch import Count, Scratch
from robot_side.field.total_overlap import sum_overlaps
from robot_side.laws.around import STILL_M_S, ways_around
from robot_side.laws.explanation import enlargement_terms, moved_and_inflated, overlaps_by_object
from robot_side.laws.felt import felt_array
from robot_side.laws.memory import Memory, Total
from robot_side.laws.path import go_to_place
from robot_side.laws.prospect import find_prospect, stopping_s
from robot_side.laws.sense import sense
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable
from robot_side.surroundings.surroundings import Surroundings
from robot_side.tick.explained import Trigger, TriggerExplained
from robot_side.tick.sensed import L2, NUMBERS, R2, Sensed
from robot_side.tick.situation import Situation

_NO_VELOCITIES: Final[FloatArray] = np.empty((0, 3))


class Asked(NamedTuple):
    """Arguments of one look, with which `Ahead.look` repeats it: gripper, objects' classes, direction, half gap."""

    pose: GripperPose
    classes: IntArray
    along: Along
    widest_m: float


class SweptLaw:
    """The law "swept". It keeps the recent looks along each side in its memory."""

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
        self.encoder_sigma_rad = encoder_sigma_rad
        self._uncertainty = uncertainty
        self._limits = limits
        self._twists = full_twists(motion)
        missed = [uncertainty.prediction.table(kind) for kind in ("operator", "robot")]
        self.memory = Memory(limits, encoder_sigma_rad, missed)
        settings = self.memory.settings[0]
        settings["trigger_speed"], settings["stick_speed"] = motion.trigger_speed_m_s, motion.stick_speed_m_s
        settings["turn_speed"] = motion.turn_speed_rad_s
        settings["touch_speed"] = touch_speed_m_s(motion.trigger_speed_m_s)
        settings["camera_variance"], settings["mean"] = uncertainty.camera_sd_m**2, uncertainty.mean_m
        settings["quantile"] = uncertainty.quantile
        self._scratch = Scratch(0, 0, 0)
        self._felt = felt_array()
        self._classes: tuple[object, IntArray, IntArray] | None = None
        self._frame: PerceivedObjects | None = None
        self._astray_m_s = 0.0
        self._room: tuple[int, SceneTable | None] = (-1, None)

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the fields and the rumble of one tick.

        ValueError for wrong sizes and for numbers that are not finite; the memory then keeps earlier looks.
        """
        pose, scene = situation.pose, self.surroundings.see(situation.objects)
        self._make_room(pose, scene)
        if (found := self._classes_of(situation)) is not self._classes:
            self._discard_probes()
            self._classes = found
        _, classes, closing = found
        velocities, (right, up) = situation.objects.velocities_m_s, situation.lateral
        if situation.objects is not self._frame:
            self._frame = situation.objects
            since = situation.objects.since
            moving = velocities if velocities is None or since is None else velocities[since[0].things]
            if moving is None or np.abs(moving).max(initial=0.0) > STILL_M_S:
                self.memory.state["moved"] = np.inf
        if situation.astray_m_s != self._astray_m_s:
            self._astray_m_s = self.memory.settings["astray"][0] = situation.astray_m_s
        if not sense(
            *(pose.tool_position_m, pose.tool_rotation, pose.tool_jacobian, pose.sphere_centers_m),
            *(pose.sphere_radii_m, pose.sphere_on_finger, situation.joint_velocities_rad_s),
            *(now_s, situation.loop_age_s, situation.loop_age_known, situation.compensation == "operator"),
            *(_widest_m(situation), right, up, classes, closing),
            *(_NO_VELOCITIES if velocities is None else velocities, scene.bundle),
            *(self._scratch.bundle, self.memory.bundle, self._felt),
        ):
            self._refuse(situation, now_s)
        return Sensed(self._felt[:NUMBERS].copy())

    def expect(self, probability: float) -> None:
        """Set the probability P of eq. 10; ConfigurationError outside (0, 1)."""
        self._uncertainty = replace(self._uncertainty, probability=probability)
        self.memory.settings["quantile"] = self._uncertainty.quantile
        self._discard_probes()

    def around(self, pose: GripperPose) -> Around | None:
        """Return the map of onset distances around `pose`; None if the map is turned off or not valid (`is_known`)."""
        until_s, onsets_m = float(self.memory.state["until"][0]), np.empty((LISTS, PROBES))
        if self._frame is None or self._classes is None or not 0.0 < until_s <= LONGEST_S:
            return None
        velocities = self._frame.velocities_m_s
        seen = self._classes[1], _NO_VELOCITIES if velocities is None else velocities, self._felt
        if not ways_around(self.memory.bundle, pose.tool_position_m, pose.tool_rotation, *seen, onsets_m):
            return None
        return Around.of(until_s, onsets_m, change_times_s(pose, self._limits, self._twists))

    @property
    def fits_a_message(self) -> bool:
        """Whether a map's message has room for all joints of this arm"""
        return len(self.encoder_sigma_rad) <= MOST_JOINTS

    def ask_around(self, *, asked: bool) -> None:
        """Turn the map, and so looks from probes around the gripper, on or off. It is off at first."""
        self.memory.settings["around"] = float(asked)

    def forget_around(self, before_s: float) -> None:
        """Forget the probes' looks made before `before_s`, so that the next tick makes all of them again."""
        at = self.memory.around["at"]
        at[at < before_s] = -np.inf

    def _discard_probes(self) -> None:
        """Discard the probes' looks, because the objects' classes or P have changed."""
        self.memory.state["counts_since"] = np.inf

    def summary(self) -> dict[str, int]:
        """Return counts over the run: looks (`fields`), their work (`Count`), and looks with nothing near.

        `flat` counts the newest scene's primitives without volume.
        """
        totals = self.memory.totals.tolist()
        counts = {"fields": totals[Total.LOOKS]} | {one.name.lower(): totals[one] for one in Count}
        # Primitives of the newest scene without volume: nothing can overlap them, so they are not felt.
        flat = 0 if self._room[1] is None else self._room[1].flat
        return counts | {"with_nothing_near": totals[Total.WITH_NOTHING_NEAR], "flat": flat}

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> TriggerExplained:
        """Return the terms of D_σ along one trigger, and the overlaps at the robot side's δ.

        Call it in the thread of the ticks, because it writes to the memory.
        """
        felt, side = (sensed.l2, L2) if trigger == "l2" else (sensed.r2, R2)
        asked = self.asked(side, situation)
        terms, sigma_m = enlargement_terms(situation, asked.along, self.encoder_sigma_rad, felt.displacement_m)
        spheres = moved_and_inflated(situation.pose, felt.displacement_m * asked.along.direction, sigma_m)
        found = overlaps_by_object(spheres, self.surroundings.see(situation.objects), asked.classes)
        return TriggerExplained(terms, found)

    def asked(self, side: int, situation: Situation, place: int = 0) -> Asked:
        """Return the arguments of a look along one side from a place; place 0 is the present pose."""
        pose, memory, (right, up) = situation.pose, self.memory, situation.lateral
        self._make_room(pose, self.surroundings.see(situation.objects))
        by_operator, age_s = situation.compensation == "operator", situation.loop_age_s
        speed_m_s = pose.tool_rotation[:, 2] @ (pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s)
        where = pose.tool_position_m, pose.tool_rotation, pose.sphere_centers_m
        gone_m = go_to_place(memory.bundle, *where, side, place, speed_m_s, age_s)
        motion = memory.rotation, pose.tool_jacobian, right, up, age_s, by_operator
        if not find_prospect(memory.bundle, side, *motion, gone_m):
            self._refuse(situation)
        found, approach_m, velocities = memory.prospect[0], None, situation.objects.velocities_m_s
        if velocities is not None:
            until_s = stopping_s(found["speed"], found["acceleration"], age_s)
            approach_m = np.clip(-velocities @ found["direction"], 0.0, None) * until_s
        along = Along(
            direction=found["direction"].copy(),
            mean_m=float(found["mean"]),
            variance_m2=self._uncertainty.camera_sd_m**2,
            quantile=self._uncertainty.quantile,
            reach_m=float(found["reach"]),
            mean_along_m=float(found["mean_along"]),
            variance_along_m2=float(found["variance_along"]),
            approach_m=approach_m,
        )
        there = replace(
            pose,
            tool_position_m=memory.tool_m.copy(),
            tool_rotation=memory.rotation.copy(),
            sphere_centers_m=memory.centers_m[: len(pose.sphere_centers_m)].copy(),
        )
        _, classes, closing = self._classes_of(situation)
        closes = place > 0 and bool(memory.state["moves_fingers"][0])
        return Asked(there, closing if closes else classes, along, _widest_m(situation))

    def _make_room(self, pose: GripperPose, scene: SceneTable) -> None:
        spheres = len(pose.sphere_radii_m)
        if self._room == (spheres, scene):
            return
        self._room, needed = (spheres, scene), (spheres, len(scene.kinds), len(scene.first_rows))
        if not self._scratch.fits(*needed):
            self._scratch = Scratch(*needed)
        if not self.memory.fits(spheres, len(scene.first_rows)):
            self.memory.make_room(spheres, len(scene.first_rows))
        # Not before the first tick: warm-up has compiled them by then, several at a time.
        self.memory.kernels[:] = [kernel.address for kernel in (find_ability, find_prospect, look, sum_overlaps)]

    def _classes_of(self, situation: Situation) -> tuple[object, IntArray, IntArray]:
        """Return roles with the held object, the objects' classes (k,), and the classes (k,) while the fingers move.

        While the fingers move the target is SKIPPED, because they shall touch it. If roles and held object are those of
        the last tick, its very tuple is returned. Only `sense` stores the result.
        """
        roles, held = situation.objects.roles, situation.held
        if self._classes is not None and self._classes[0] == (roles, held):
            return self._classes
        of_role = {
            Role.TARGET: TARGET,
            Role.IGNORED: SKIPPED,
            Role.SUPPORT: OBSTACLE if held is None else TOUCHABLE,
        }
        classes = np.array([of_role.get(role, OBSTACLE) for role in roles], dtype=np.int64)
        if held is not None:
            classes[held] = SKIPPED
        return (roles, held), classes, np.where(classes == TARGET, SKIPPED, classes)

    def _refuse(self, situation: Situation, now_s: float = 0.0) -> NoReturn:
        """Raise a ValueError that names the field of `situation` that is not finite or has the wrong size."""
        pose, limits_rad_s, rates = situation.pose, self._limits.velocity_rad_s, situation.joint_velocities_rad_s
        joints, spheres = len(self.encoder_sigma_rad), len(pose.sphere_radii_m)
        for name, count, valid in (
            ("joint_velocities_rad_s", len(rates), joints),
            ("limits.velocity_rad_s", len(limits_rad_s), joints),
            ("pose.tool_jacobian's columns", pose.tool_jacobian.shape[1], joints),
            ("pose.sphere_centers_m", len(pose.sphere_centers_m), spheres),
            ("pose.sphere_on_finger", len(pose.sphere_on_finger), spheres),
        ):
            if count != valid:
                raise ValueError(f"{name} = {count}; valid: {valid}, the number that the law was made for")
        for name in ("tool_position_m", "tool_rotation", "tool_jacobian", "sphere_centers_m", "sphere_radii_m"):
            require_finite(f"pose.{name}", getattr(pose, name))
        require_finite("joint_velocities_rad_s", rates)
        for name, numbers in (("loop_age_s", situation.loop_age_s), ("lateral", situation.lateral), ("now_s", now_s)):
            require_finite(name, np.atleast_1d(np.array(numbers)))
        refuse(pose.tool_jacobian, np.ones(6), limits_rad_s)


def _widest_m(situation: Situation) -> float:
    """Return half the gap between the fingers, to which the inflation of their spheres towards the target is limited.

    See §3.4; infinite without a gap.
    """
    return math.inf if situation.gap_m is None else 0.5 * max(situation.gap_m, 0.0)
