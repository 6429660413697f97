"""The law "swept": the gripper, inflated by D_σ, is moved along each trigger until it overlaps something (§4.2).

Fields are worked out in turns, one a tick at most: R2, L2, and along the stick while that is deflected. In between
the ways are shortened by what the tool has moved along, which for a translation is exact. The shortest of the last
tenth of a second hold: where the gripper just passes something, the encoders' noise alone makes full strength of none.

While the gripper drifts, turns, or moves its fingers, R2 and L2 are looked along from where that will have brought it,
too, at several moments until a command that is sent now has stopped it: the shortest ways hold. What comes towards the
gripper by itself shortens its ways by what it covers in that time.
"""

import math
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.messages import TriggerField, Ways
from common.reaction import HORIZON_S
from common.touch_speed import touch_speed_m_s
from robot_side.ahead.explanation import (
    Trigger,
    TriggerExplained,
    enlargement_terms,
    moved_and_inflated,
    overlaps_by_object,
)
from robot_side.ahead.field import Ahead, Along
from robot_side.ahead.find import OBSTACLE, PASSED_OVER, TARGET, TOUCHABLE
from robot_side.ahead.law import Sensed, Situation
from robot_side.ahead.looks import Places, Seen
from robot_side.ahead.scene_table import scene_table
from robot_side.ahead.sideways import FingerMotion, Sideways
from robot_side.ahead.tables import STRENGTHS
from robot_side.ahead.total_overlap import total_overlap_m3
from robot_side.arm.ability import Ability, JointLimits, ability, along_approach
from robot_side.arm.tool_motion import ToolMotionSettings, deflected
from robot_side.enlargement.distance import Uncertainty
from robot_side.objects.perceived import Role

FIELD_PERIOD_S: Final = 0.01
"""A controller is written to no more often."""
BEYOND_M: Final = 0.05
"""So much farther than what a reaction, the loop age and braking take is looked, as the loop age varies."""
_MOST_M: Final = 100.0
"""What a message can say; a simulation about to become unstable shows wild figures, and must get to say so."""

Side = Literal["r2", "l2", "stick"]
_SIDES: Final[tuple[Side, ...]] = ("r2", "l2", "stick")


class SweptLaw:
    """Keeps each side's newest field."""

    def __init__(
        self, uncertainty: Uncertainty, encoder_sigma_rad: FloatArray, limits: JointLimits, motion: ToolMotionSettings
    ) -> None:
        """encoder_sigma_rad (n,): eq. 3."""
        self.ahead = Ahead(encoder_sigma_rad)
        self._uncertainty = uncertainty
        self._limits = limits
        self._motion = motion
        self._places: dict[Side, Places] = {}
        self._fingers = FingerMotion()
        self._sideways: tuple[float, Sideways, tuple[float, ...]] | None = None
        """When it was measured, and the moments after which to look from where it leads"""
        self._standing: tuple[object, IntArray] | None = None

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick; at most one field is looked at, but for the first tick."""
        velocity = situation.pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s
        speed_m_s = float(velocity @ situation.pose.tool_rotation[:, 2])
        self._look_where_due(situation, velocity, now_s)
        r2, l2 = self._places["r2"], self._places["l2"]
        tool_m = situation.pose.tool_position_m
        horizon_m = min(
            min(self._horizon_m(places.newest.ability, situation.loop_age_s), places.known_m(tool_m))
            for places in (r2, l2)
        )
        leading = (r2 if speed_m_s >= 0.0 else l2).newest
        return Sensed(
            l2=self._trigger_field(l2, situation, -speed_m_s, horizon_m),
            r2=self._trigger_field(r2, situation, speed_m_s, horizon_m),
            speed_m_s=_bounded(speed_m_s),
            horizon_m=max(0.0, _bounded(horizon_m)),
            rumble=self._rumble(situation),
            enlargement_m=float(np.linalg.norm(velocity)) * situation.loop_age_s + leading.field.sigma_m,
            overlap_m3=leading.overlap_m3,
        )

    def expect(self, probability: float) -> None:
        """P of eq. 10 from now on; ConfigurationError outside (0, 1)."""
        self._uncertainty = replace(self._uncertainty, probability=probability)

    def summary(self) -> dict[str, int]:
        """How much work there was and was not, over the run."""
        return vars(self.ahead.counts)

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> TriggerExplained:
        """What D_σ is made of along one trigger, and what overlaps at the robot side's δ."""
        felt = sensed.l2 if trigger == "l2" else sensed.r2
        along, _, prediction_sd_m = self._along(trigger, situation)
        camera_sd_m = self._uncertainty.camera_sd_m
        terms, sigma_m = enlargement_terms(
            *(situation, along, self.ahead.encoder_sigma_rad, camera_sd_m, prediction_sd_m, felt.displacement_m)
        )
        spheres = moved_and_inflated(situation, felt.displacement_m * along.direction, sigma_m)
        standing = self._stands(situation)
        found = overlaps_by_object(spheres, scene_table(situation.objects), standing, self.ahead.tables)
        return TriggerExplained(terms, found)

    def _look_where_due(self, situation: Situation, velocity: FloatArray, now_s: float) -> None:
        """Look where that is due longest, and elsewhere only where it is overdue. velocity (3,): of the tool."""
        last = self._sideways
        # What is gripped or let go changes which spheres there are.
        if (
            last is None
            or now_s - last[0] >= FIELD_PERIOD_S - 1e-9
            or last[1].own_m_s.shape != situation.pose.sphere_centers_m.shape
        ):
            last = self._sideways = self._measure(situation, velocity, now_s)
        _, sideways, moments = last
        if situation.lateral == (0.0, 0.0):
            self._places.pop("stick", None)
        ages_s: dict[tuple[Side, int], float] = {}
        for side in _SIDES if situation.lateral != (0.0, 0.0) else _SIDES[:2]:
            count = 1 if side == "stick" else 1 + len(moments)
            places = self._places.setdefault(side, Places())
            places.keep(count)
            ages_s |= {(side, place): places.age_s(place, now_s) for place in range(count)}
        speed_m_s = float(velocity @ situation.pose.tool_rotation[:, 2])
        for number, (side, place) in enumerate(sorted(ages_s, key=lambda one: -ages_s[one])):
            if ages_s[side, place] >= FIELD_PERIOD_S * (1.0 if number == 0 else 2.0) - 1e-9:
                there, moved = situation, None
                if place > 0:
                    there, moved = replace(situation, pose=sideways.moved(situation.pose, moments[place - 1])), sideways
                self._places[side].add(place, self._look(side, there, moved, speed_m_s, now_s))

    def _measure(
        self, situation: Situation, velocity: FloatArray, now_s: float
    ) -> tuple[float, Sideways, tuple[float, ...]]:
        pose = situation.pose
        approach = pose.tool_rotation[:, 2]
        sideways = Sideways(
            velocity - (velocity @ approach) * approach,
            pose.tool_jacobian[3:] @ situation.joint_velocities_rad_s,
            self._fingers.see(pose, now_s),
        )
        able = along_approach(pose, self._limits, self._motion.trigger_speed_m_s)
        stopping_s = _stopping_s(situation, able)
        return now_s, sideways, sideways.moments(pose, stopping_s, stopping_s * able.full_speed_m_s)

    def _look(
        self, side: Side, situation: Situation, sideways: Sideways | None, speed_m_s: float, now_s: float
    ) -> Seen:
        """sideways: what has brought the gripper to this pose; None where it stands there now."""
        pose = situation.pose
        along, able, _ = self._along(side, situation)
        scene, standing = scene_table(situation.objects), self._stands(situation)
        if sideways is not None and sideways.moves_fingers:
            # What the fingers close on is what they are to touch.
            standing = np.where(standing == TARGET, PASSED_OVER, standing)
        widest_m = math.inf if situation.gap_m is None else 0.5 * situation.gap_m
        found = self.ahead.look(pose, scene, standing, along, widest_m)
        overlap_m3 = 0.0
        if sideways is None and side != "stick" and (side == "r2") == (speed_m_s >= 0.0):
            sigma_m = self.ahead.tables.sigma_m[: len(pose.sphere_radii_m), 0]
            spheres = moved_and_inflated(situation, abs(speed_m_s) * situation.loop_age_s * along.direction, sigma_m)
            overlap_m3 = total_overlap_m3(spheres, scene, standing, self.ahead.tables)
        return Seen(found, along.direction, pose.tool_position_m, able, along.reach_m, now_s, overlap_m3)

    def _along(self, side: Side, situation: Situation) -> tuple[Along, Ability, float]:
        """What the errors are along one side, what the joints give there, and σ_δ."""
        pose = situation.pose
        direction = np.ascontiguousarray({"r2": 1.0, "l2": -1.0}.get(side, 0.0) * pose.tool_rotation[:, 2])
        full_speed_m_s = self._motion.trigger_speed_m_s
        if side == "stick":
            direction, full_speed_m_s = (
                deflected(situation.lateral, pose.tool_rotation)[0],
                self._motion.stick_speed_m_s,
            )
        able = ability(pose, self._limits, direction, full_speed_m_s)
        # The stick is felt where it leads with the speed that it commands: nothing is predicted.
        mean_m, sd_m = (
            (0.0, 0.0)
            if side == "stick"
            else self._uncertainty.predicted_m(situation.compensation, situation.loop_age_s, able.full_speed_m_s)
        )
        reach_m = self._horizon_m(able, situation.loop_age_s) + 2.0 * FIELD_PERIOD_S * full_speed_m_s
        along = Along(
            direction,
            self._uncertainty.mean_along_m(direction) + mean_m,
            self._uncertainty.camera_sd_m**2 + sd_m**2,
            self._uncertainty.quantile,
            reach_m,
            _early_m(situation, direction, able),
        )
        return along, able, sd_m

    def _stands(self, situation: Situation) -> IntArray:
        """(k,) what each object is to the field."""
        key = situation.objects.roles, situation.held
        if self._standing is None or self._standing[0] != key:
            of_role = {
                Role.TARGET: TARGET,
                Role.IGNORED: PASSED_OVER,
                Role.SUPPORT: OBSTACLE if situation.held is None else TOUCHABLE,
            }
            standing = np.array([of_role.get(role, OBSTACLE) for role in key[0]], dtype=np.int64)
            if situation.held is not None:
                standing[situation.held] = PASSED_OVER
            self._standing = key, standing
        return self._standing[1]

    def _horizon_m(self, able: Ability, loop_age_s: float) -> float:
        """How far full speed gets before anything felt stops it, and a little more."""
        speed = able.full_speed_m_s
        return speed * (loop_age_s + HORIZON_S) + speed * speed / (2.0 * able.acceleration_m_s2) + BEYOND_M

    def _trigger_field(self, looks: Places, situation: Situation, speed_m_s: float, horizon_m: float) -> TriggerField:
        able = looks.newest.ability
        # What is under way from an operator who has echoed nothing is not known: at worst full speed.
        under_way_m_s = speed_m_s if situation.loop_age_known else max(speed_m_s, able.full_speed_m_s)
        displacement_m = _bounded(under_way_m_s * situation.loop_age_s)
        fast_m, slow_m = looks.ways_m(situation.pose.tool_position_m)
        fast = _streamed(fast_m, horizon_m)
        return TriggerField(
            fast_m=fast,
            slow_m=_streamed(slow_m, horizon_m),
            full_speed_m_s=able.full_speed_m_s,
            acceleration_m_s2=able.acceleration_m_s2,
            displacement_m=displacement_m,
            stiffness=sum(way <= displacement_m for way in fast) / STRENGTHS,
        )

    def _rumble(self, situation: Situation) -> float:
        """The strength, in eighths, where the stick leads: D = u (t_d + h) + u²/2a (eq. 8)."""
        looks = self._places.get("stick")
        if looks is None:
            return 0.0
        speed = self._motion.stick_speed_m_s * deflected(situation.lateral, situation.pose.tool_rotation)[1]
        braking_m = speed * speed / (2.0 * looks.newest.ability.acceleration_m_s2)
        fast_m, slow_m = looks.ways_m(situation.pose.tool_position_m)
        ways_m = slow_m if speed < touch_speed_m_s(self._motion.trigger_speed_m_s) else fast_m
        reached = ways_m <= speed * (situation.loop_age_s + HORIZON_S) + braking_m
        return int(np.count_nonzero(reached)) / STRENGTHS


def _early_m(situation: Situation, direction: FloatArray, able: Ability) -> FloatArray | None:
    """By how much each object's ways (k,) are shorter: what it comes nearer by until the arm stands."""
    velocities = situation.objects.velocities_m_s
    if velocities is None:
        return None
    nearing_m_s = np.maximum(-(velocities @ direction), 0.0)
    early: FloatArray = np.minimum(nearing_m_s * _stopping_s(situation, able), _MOST_M)
    return early


def _stopping_s(situation: Situation, able: Ability) -> float:
    """From a report until the arm stands, which went at full speed and was told to stop by what is felt of it."""
    return situation.loop_age_s + HORIZON_S + able.full_speed_m_s / able.acceleration_m_s2


def _streamed(ways_m: FloatArray, horizon_m: float) -> Ways:
    ways = np.clip(ways_m, -_MOST_M, min(horizon_m, _MOST_M)).tolist()
    return tuple(ways)


def _bounded(value: float) -> float:
    return min(max(value, -_MOST_M), _MOST_M)
