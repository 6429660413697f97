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
from typing import Final

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
from robot_side.ahead.felt import (
    ACCELERATION,
    DISPLACEMENT,
    ENLARGEMENT,
    FULL_SPEED,
    HORIZON,
    MOST_M,
    OF_A_SIDE,
    OVERLAP,
    RUMBLE,
    SPEED,
    STIFFNESS,
    feel,
    horizon_m,
    room_to_feel,
)
from robot_side.ahead.field import Ahead, Along
from robot_side.ahead.find import OBSTACLE, PASSED_OVER, TARGET, TOUCHABLE
from robot_side.ahead.law import Sensed, Situation
from robot_side.ahead.looks import L2, R2, STICK, Looks
from robot_side.ahead.scene_table import scene_table
from robot_side.ahead.sideways import FingerMotion, Sideways
from robot_side.ahead.tables import STRENGTHS
from robot_side.ahead.total_overlap import looked_overlap_m3
from robot_side.arm.ability import Ability, JointLimits, ability, along_approach
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings, deflected
from robot_side.compiled.kernel import NUMBER, compiled, input_array, output_array
from robot_side.compiled.vectors import dot, load
from robot_side.enlargement.distance import Uncertainty
from robot_side.objects.perceived import Role

FIELD_PERIOD_S: Final = 0.01
"""A controller is written to no more often."""
_ROUNDING_S: Final = 1e-9


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
        self._touch_speed_m_s = touch_speed_m_s(motion.trigger_speed_m_s)
        self._looks = Looks()
        self._felt = room_to_feel()
        self._fingers = FingerMotion()
        self._sideways: Sideways | None = None
        self._moments: tuple[float, ...] = ()
        """After which to look from where `_sideways` leads"""
        self._measured_s = -math.inf
        self._next_s = -math.inf
        """When something is to be measured or looked at again, at the earliest"""
        self._standing: tuple[object, IntArray] | None = None

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick; at most one field is looked at, but for the first tick."""
        pose, looks = situation.pose, self._looks
        stick = math.hypot(*situation.lateral)
        # What is gripped or let go changes which spheres there are.
        changed = self._sideways is None or len(self._sideways.own_m_s) != len(pose.sphere_radii_m)
        if now_s >= self._next_s or changed or bool(stick) != bool(looks.looked_s[STICK]):
            self._look_where_due(situation, now_s, changed)
        feel(
            *(looks.seen, looks.counts, looks.newest),
            *(pose.tool_position_m, np.ascontiguousarray(pose.tool_rotation), np.ascontiguousarray(pose.tool_jacobian)),
            *(situation.joint_velocities_rad_s, situation.loop_age_s, situation.loop_age_known),
            *(self._motion.stick_speed_m_s * min(stick, 1.0), self._touch_speed_m_s, self._felt),
        )
        felt = self._felt.tolist()
        return Sensed(
            l2=_trigger_field(felt, L2),
            r2=_trigger_field(felt, R2),
            speed_m_s=felt[SPEED],
            horizon_m=felt[HORIZON],
            rumble=felt[RUMBLE],
            enlargement_m=felt[ENLARGEMENT],
            overlap_m3=felt[OVERLAP],
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
        along, _, prediction_sd_m = self._along(L2 if trigger == "l2" else R2, situation, situation.pose)
        camera_sd_m = self._uncertainty.camera_sd_m
        terms, sigma_m = enlargement_terms(
            *(situation, along, self.ahead.encoder_sigma_rad, camera_sd_m, prediction_sd_m, felt.displacement_m)
        )
        spheres = moved_and_inflated(situation.pose, felt.displacement_m * along.direction, sigma_m)
        standing = self._stands(situation)
        found = overlaps_by_object(spheres, scene_table(situation.objects), standing, self.ahead.tables)
        return TriggerExplained(terms, found)

    def _look_where_due(self, situation: Situation, now_s: float, changed: bool) -> None:
        """Look where that is due longest, and elsewhere only where it is overdue."""
        pose, looks = situation.pose, self._looks
        velocity = pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s
        speed_m_s = float(velocity @ pose.tool_rotation[:, 2])
        if self._sideways is None or changed or now_s - self._measured_s >= FIELD_PERIOD_S - _ROUNDING_S:
            self._measured_s = now_s
            self._sideways, self._moments = self._measure(situation, velocity, speed_m_s, now_s)
        for side in (R2, L2):
            looks.look_from(side, 1 + len(self._moments))
        looks.look_from(STICK, 0 if situation.lateral == (0.0, 0.0) else 1)
        ages = [
            (looked_s - now_s, side, place)
            for side, all_looked_s in enumerate(looks.looked_s)
            for place, looked_s in enumerate(all_looked_s)
        ]
        pause_s = FIELD_PERIOD_S
        for younger_s, side, place in sorted(ages):
            if -younger_s >= pause_s - _ROUNDING_S:
                there, by = pose, None
                if place > 0:
                    there, by = self._sideways.moved(pose, self._moments[place - 1]), self._sideways
                self._look(side, place, situation, there, by, speed_m_s, now_s)
            pause_s = 2.0 * FIELD_PERIOD_S
        self._next_s = min(self._measured_s, *map(min, filter(None, looks.looked_s))) + FIELD_PERIOD_S - _ROUNDING_S

    def _measure(
        self, situation: Situation, velocity: FloatArray, speed_m_s: float, now_s: float
    ) -> tuple[Sideways, tuple[float, ...]]:
        """What moves the gripper besides the triggers; velocity (3,): of the tool."""
        pose = situation.pose
        sideways = Sideways(
            velocity - speed_m_s * pose.tool_rotation[:, 2],
            pose.tool_jacobian[3:] @ situation.joint_velocities_rad_s,
            self._fingers.see(pose, now_s),
        )
        able = along_approach(pose, self._limits, self._motion.trigger_speed_m_s)
        stopping_s = _stopping_s(situation, able)
        return sideways, sideways.moments(pose, stopping_s, stopping_s * able.full_speed_m_s)

    def _look(
        self,
        side: int,
        place: int,
        situation: Situation,
        pose: GripperPose,
        sideways: Sideways | None,
        speed_m_s: float,
        now_s: float,
    ) -> None:
        """sideways: what has brought the gripper to this pose; None where it stands there now."""
        along, able, _ = self._along(side, situation, pose)
        scene, standing = scene_table(situation.objects), self._stands(situation)
        if sideways is not None and sideways.moves_fingers:
            # What the fingers close on is what they are to touch.
            standing = np.where(standing == TARGET, PASSED_OVER, standing)
        widest_m = math.inf if situation.gap_m is None else 0.5 * situation.gap_m
        found = self.ahead.look(pose, scene, standing, along, widest_m)
        overlap_m3 = 0.0
        if place == 0 and side == (R2 if speed_m_s >= 0.0 else L2):
            moved_m = abs(speed_m_s) * situation.loop_age_s * along.direction
            spheres = len(pose.sphere_radii_m)
            overlap_m3 = looked_overlap_m3(moved_m, spheres, scene, standing, self.ahead.tables)
        where = along.direction, pose.tool_position_m, found.ways_m
        self._looks.add(side, place, now_s, *where, able, along.reach_m, found.sigma_m, overlap_m3)

    def _along(self, side: int, situation: Situation, pose: GripperPose) -> tuple[Along, Ability, float]:
        """What the errors are along one side, what the joints give there, and σ_δ."""
        if side == STICK:
            full_speed_m_s = self._motion.stick_speed_m_s
            direction = deflected(situation.lateral, pose.tool_rotation)[0]
        else:
            full_speed_m_s = self._motion.trigger_speed_m_s
            direction = np.ascontiguousarray((1.0 if side == R2 else -1.0) * pose.tool_rotation[:, 2])
        able = ability(pose, self._limits, direction, full_speed_m_s)
        # The stick is felt where it leads with the speed that it commands: nothing is predicted.
        mean_m, sd_m = (
            (0.0, 0.0)
            if side == STICK
            else self._uncertainty.predicted_m(situation.compensation, situation.loop_age_s, able.full_speed_m_s)
        )
        reach_m = horizon_m(able.full_speed_m_s, able.acceleration_m_s2, situation.loop_age_s)
        along = Along(
            direction,
            self._uncertainty.mean_along_m(direction) + mean_m,
            self._uncertainty.camera_sd_m**2 + sd_m**2,
            self._uncertainty.quantile,
            reach_m + 2.0 * FIELD_PERIOD_S * full_speed_m_s,
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


def _early_m(situation: Situation, direction: FloatArray, able: Ability) -> FloatArray | None:
    """By how much each object's ways (k,) are shorter: what it comes nearer by until the arm stands."""
    velocities = situation.objects.velocities_m_s
    if velocities is None:
        return None
    early: FloatArray = np.empty(len(velocities))
    _nearing(np.ascontiguousarray(velocities), direction, _stopping_s(situation, able), early)
    return early


@compiled(input_array(2), input_array(1), NUMBER, output_array(1))
def _nearing(velocities: FloatArray, direction: FloatArray, stopping: float, early: FloatArray) -> None:
    along = load(direction.reshape(1, 3), 0)
    for thing in range(early.size):
        early[thing] = min(max(-dot(load(velocities, thing), along), 0.0) * stopping, MOST_M)


def _stopping_s(situation: Situation, able: Ability) -> float:
    """From a report until the arm stands, which went at full speed and was told to stop by what is felt of it."""
    return situation.loop_age_s + HORIZON_S + able.full_speed_m_s / able.acceleration_m_s2


def _trigger_field(felt: list[float], side: int) -> TriggerField:
    mine = felt[side * OF_A_SIDE : (side + 1) * OF_A_SIDE]
    return TriggerField(
        fast_m=_eight(mine, 0),
        slow_m=_eight(mine, STRENGTHS),
        full_speed_m_s=mine[FULL_SPEED],
        acceleration_m_s2=mine[ACCELERATION],
        displacement_m=mine[DISPLACEMENT],
        stiffness=mine[STIFFNESS],
    )


def _eight(numbers: list[float], first: int) -> Ways:
    one, two, three, four, five, six, seven, eight = numbers[first : first + STRENGTHS]
    return one, two, three, four, five, six, seven, eight
