"""The law "swept": the gripper, inflated by D_σ, is moved along each trigger until it overlaps something (§4.2).

Fields are worked out in turns, one in a tick: R2, L2, and along the stick while that is deflected. In between the ways
are shortened by what the tool has moved along, which is exact for a translation. The shortest of the last 0.1 s hold:
where the gripper just passes something, encoder noise alone can flip no strength to full.

While the gripper drifts, turns, or moves its fingers, R2 and L2 are looked along from where that will have brought it,
too, at several moments until a command that is sent now has stopped it: the shortest ways hold. What comes towards the
gripper by itself shortens its ways by what it covers in that time.
"""

import math
from dataclasses import replace

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.messages import TriggerField, Ways
from common.touch_speed import touch_speed_m_s
from robot_side.arm.ability import Ability, JointLimits, ability
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings, deflected
from robot_side.compiled.kernel import NUMBER, compiled, input_array, output_array
from robot_side.compiled.vectors import dot, load
from robot_side.enlargement.distance import Uncertainty
from robot_side.field.field import Ahead, Along
from robot_side.field.object_class import OBSTACLE, PASSED_OVER, TARGET, TOUCHABLE
from robot_side.field.scratch import STRENGTHS
from robot_side.laws.explanation import (
    Trigger,
    TriggerExplained,
    enlargement_terms,
    moved_and_inflated,
    overlaps_by_object,
)
from robot_side.laws.felt import (
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
from robot_side.laws.law import Sensed, Situation
from robot_side.laws.recent_looks import L2, R2, STICK
from robot_side.laws.schedule import FIELD_PERIOD_S, Prospect, Turns, stopping_s
from robot_side.surroundings.perceived import Role
from robot_side.surroundings.surroundings import Surroundings


class SweptLaw:
    """Keeps each side's newest field."""

    def __init__(
        self,
        uncertainty: Uncertainty,
        encoder_sigma_rad: FloatArray,
        limits: JointLimits,
        motion: ToolMotionSettings,
        surroundings: Surroundings | None = None,
    ) -> None:
        """encoder_sigma_rad (n,): eq. 3. surroundings: the owner of what is perceived; one of its own by default."""
        self.surroundings = surroundings or Surroundings()
        self.ahead = Ahead(encoder_sigma_rad)
        self._uncertainty = uncertainty
        self._limits = limits
        self._motion = motion
        self._touch_speed_m_s = touch_speed_m_s(motion.trigger_speed_m_s)
        self._felt = room_to_feel()
        self._classes: tuple[object, IntArray] | None = None
        self.turns = Turns(self.ahead, self.surroundings, self._prospect, limits, motion.trigger_speed_m_s)

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick."""
        pose, stick = situation.pose, math.hypot(*situation.lateral)
        looks = self.turns.take(situation, now_s)
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
        classes = self._classes_of(situation)
        found = overlaps_by_object(spheres, self.surroundings.see(situation.objects), classes)
        return TriggerExplained(terms, found)

    def _prospect(self, side: int, situation: Situation, pose: GripperPose) -> Prospect:
        along, able, _ = self._along(side, situation, pose)
        return Prospect(along, able, self._classes_of(situation))

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

    def _classes_of(self, situation: Situation) -> IntArray:
        """(k,) what each object is to the field."""
        key = situation.objects.roles, situation.held
        if self._classes is None or self._classes[0] != key:
            of_role = {
                Role.TARGET: TARGET,
                Role.IGNORED: PASSED_OVER,
                Role.SUPPORT: OBSTACLE if situation.held is None else TOUCHABLE,
            }
            classes = np.array([of_role.get(role, OBSTACLE) for role in key[0]], dtype=np.int64)
            if situation.held is not None:
                classes[situation.held] = PASSED_OVER
            self._classes = key, classes
        return self._classes[1]


def _early_m(situation: Situation, direction: FloatArray, able: Ability) -> FloatArray | None:
    """By how much each object's ways (k,) are shorter: what it comes nearer by until the arm stands."""
    velocities = situation.objects.velocities_m_s
    if velocities is None:
        return None
    early: FloatArray = np.empty(len(velocities))
    _nearing(np.ascontiguousarray(velocities), direction, stopping_s(situation, able), early)
    return early


@compiled(input_array(2), input_array(1), NUMBER, output_array(1))
def _nearing(velocities: FloatArray, direction: FloatArray, stopping: float, early: FloatArray) -> None:
    along = load(direction.reshape(1, 3), 0)
    for thing in range(early.size):
        early[thing] = min(max(-dot(load(velocities, thing), along), 0.0) * stopping, MOST_M)


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
