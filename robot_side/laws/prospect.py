"""Prospect of a look along one direction: what is asked of it, by the errors (eq. 9-10) and the arm's ability."""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.reaction import HORIZON_S
from robot_side.arm.ability import Ability, ability
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.enlargement.distance import Uncertainty
from robot_side.field.along import Along
from robot_side.field.object_errors import largest_errors, object_errors
from robot_side.laws.law import MOST_M
from robot_side.laws.path import Waypoint, at_waypoint
from robot_side.tick.sensed import R2, STICK
from robot_side.tick.situation import Situation

BEYOND_M: Final = 0.05
"""Distance examined beyond the stopping distance (loop age, reaction and braking), because the loop age varies"""
BETWEEN_S: Final = 0.02
"""Time for which the gripper may go on at full speed after a look, and its surroundings are still known"""


class Asked(NamedTuple):
    """Arguments of one look, `Ahead.look`: gripper, objects' classes, direction, half gap."""

    pose: GripperPose
    classes: IntArray
    along: Along
    widest_m: float


class Prospect(NamedTuple):
    """Arguments of a look, the arm's ability along it, and how its onset distances count from the tool."""

    asked: Asked
    able: Ability
    gone_m: float = 0.0
    """Distance that the trigger has moved the gripper when it is at the look's waypoint"""
    stretch: float = 1.0
    """Length of the curved path divided by that of its chord"""

    def from_tool_m(self, onsets_m: FloatArray) -> FloatArray:
        """Return a look's onset distances as distances from the tool's present position."""
        return onsets_m if self.stretch == 1.0 and self.gone_m == 0.0 else self.gone_m + self.stretch * onsets_m


@dataclass(frozen=True)
class Assumed:
    """Assumptions of a law: errors, the arm's limits and its speeds at full travel and deflection."""

    uncertainty: Uncertainty
    limits: JointLimits
    motion: ToolMotionSettings


def stopping_s(able: Ability, loop_age_s: float) -> float:
    """Return the time from a report until the arm stands: full speed for loop age and reaction, then braking."""
    return loop_age_s + HORIZON_S + able.full_speed_m_s / able.acceleration_m_s2


def horizon_m(able: Ability, loop_age_s: float) -> float:
    """Return the distance to examine: the stopping distance from full speed, reaction included, plus BEYOND_M."""
    speed_m_s = able.full_speed_m_s
    return speed_m_s * (loop_age_s + HORIZON_S) + speed_m_s**2 / (2.0 * able.acceleration_m_s2) + BEYOND_M


def prospect(
    side: int,
    situation: Situation,
    ahead_m_s: float,
    classes: IntArray,
    assumed: Assumed,
    waypoint: Waypoint | None = None,
) -> Prospect:
    """Return the prospect of a look along one side from the gripper's present pose, or from a waypoint.

    ahead_m_s: the tool's speed along its approach axis; commands under way keep it for at most the loop age. classes
    (k,): the objects'.
    """
    pose, age_s, (right, up) = situation.pose, situation.loop_age_s, situation.lateral
    forth, full_speed_m_s, gone_m, stretch = (1.0 if side == R2 else -1.0), assumed.motion.trigger_speed_m_s, 0.0, 1.0
    direction: FloatArray = forth * pose.tool_rotation[:, 2]
    if side == STICK:
        full_speed_m_s = assumed.motion.stick_speed_m_s
        across = right * pose.tool_rotation[:, 0] - up * pose.tool_rotation[:, 1]
        direction = across / math.hypot(right, up)
    elif waypoint is not None:
        gone_m = max(forth * ahead_m_s, 0.0) * min(waypoint.moved_s, age_s)
        pose, chord = at_waypoint(pose, waypoint, forth * gone_m)
        stretch = 1.0 / math.sqrt(float(chord @ chord))
        direction = (forth * stretch) * chord
    able = ability(pose, assumed.limits, direction, full_speed_m_s)
    farthest_m = horizon_m(able, age_s) + BETWEEN_S * full_speed_m_s
    along = _along(direction, able, situation, assumed.uncertainty, max(farthest_m - gone_m, 0.0) / stretch, side)
    widest_m = math.inf if situation.gap_m is None else 0.5 * max(situation.gap_m, 0.0)
    return Prospect(Asked(pose, classes, along, widest_m), able, gone_m, stretch)


def _along(
    direction: FloatArray, able: Ability, situation: Situation, uncertainty: Uncertainty, reach_m: float, side: int
) -> Along:
    """Return the direction with the errors along it, and what comes nearer against it."""
    age_s, mean_m, sd_m = situation.loop_age_s, 0.0, 0.0
    # The stick's rumble takes the commanded speed: no prediction, so no prediction error.
    if side != STICK:
        mean_m, sd_m = uncertainty.prediction.at(situation.compensation, age_s, able.full_speed_m_s)
    # Until it stands, an arm that does not follow goes on as it now does.
    mean_m += situation.astray_m_s * (age_s + able.full_speed_m_s / able.acceleration_m_s2)
    mean_m += situation.later_s * able.full_speed_m_s
    velocities_m_s, approach_m = situation.objects.velocities_m_s, None
    if velocities_m_s is not None and velocities_m_s.any():
        closing_m_s = np.maximum(-(velocities_m_s @ direction), 0.0)
        approach_m = np.minimum(closing_m_s * stopping_s(able, age_s), MOST_M)
    of_objects = object_errors(situation.objects, uncertainty)
    unseen_m, variance_m2 = largest_errors(of_objects, uncertainty)
    return Along(
        direction=direction,
        mean_m=uncertainty.mean_along_m(direction),
        variance_m2=variance_m2,
        quantile=uncertainty.quantile,
        reach_m=reach_m,
        mean_along_m=mean_m,
        variance_along_m2=sd_m * sd_m,
        approach_m=approach_m,
        unseen_m=unseen_m,
        of_objects=of_objects,
    )
