"""Which field is looked at in a tick: they take turns, the one that has waited longest first.

R2, L2, and the stick while it is deflected, each from where the gripper is and from where it will have drifted, turned
or closed its fingers to. A look takes one tick. A tick has one look, two while a field is 1.5 periods old, and all that
are due after 5 periods, or where a place is new.
"""

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.reaction import HORIZON_S
from robot_side.arm.ability import Ability, JointLimits, along_approach
from robot_side.arm.port import GripperPose
from robot_side.field.field import Ahead, Along
from robot_side.field.object_class import PASSED_OVER, TARGET
from robot_side.field.total_overlap import total_overlap_m3
from robot_side.laws.law import Situation
from robot_side.laws.recent_looks import L2, R2, STICK, Looks
from robot_side.laws.sideways import FingerMotion, Sideways
from robot_side.surroundings.surroundings import Surroundings

FIELD_PERIOD_S: Final = 0.01
"""A controller is written to no more often. From where the gripper is yet to come, it is looked half as often."""
OVERLAP_PERIOD_S: Final = 0.02
"""The overlap at δ is a figure that people read."""
_ROUNDING: Final = 1e-6
_ROUNDING_S: Final = 1e-9
_OVERDUE: Final = 1.5
"""While a field is this many periods old, a tick has two looks;"""
_FAR_BEHIND: Final = 5.0
"""and while one is this old, or was never looked at, a tick has all that are due."""


class Prospect(NamedTuple):
    """How to look along one side: the errors there, what the joints give there, and what each object is (k,)."""

    along: Along
    able: Ability
    classes: IntArray


class Turns:
    """Keeps what was seen, and goes on looking."""

    def __init__(
        self,
        ahead: Ahead,
        surroundings: Surroundings,
        prospect: Callable[[int, Situation, GripperPose], Prospect],
        limits: JointLimits,
        trigger_speed_m_s: float,
    ) -> None:
        self.ahead = ahead
        self._surroundings = surroundings
        self._prospect = prospect
        self._limits = limits
        self._trigger_speed_m_s = trigger_speed_m_s
        self.looks = Looks()
        self._fingers = FingerMotion()
        self._sideways: Sideways | None = None
        self._moments: tuple[float, ...] = ()
        """After which to look from where `_sideways` leads"""
        self._measured_s = -math.inf
        self._next_s = -math.inf
        """When there is something to do again, at the earliest"""
        self._overlap_m3 = 0.0
        self._next_overlap_s = -math.inf

    def take(self, situation: Situation, now_s: float) -> Looks:
        """Do what is due in this tick; what has been seen so far. The first tick looks at everything."""
        # What is gripped or let go changes which spheres there are.
        changed = self._sideways is None or len(self._sideways.own_m_s) != len(situation.pose.sphere_radii_m)
        looks, deflected = self.looks, situation.lateral != (0.0, 0.0)
        if now_s >= self._next_s or changed or deflected != bool(looks.looked_s[STICK]):
            velocity = situation.pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s
            speed_m_s = float(velocity @ situation.pose.tool_rotation[:, 2])
            at_most = 1
            if changed or now_s - self._measured_s >= FIELD_PERIOD_S - _ROUNDING_S:
                self._measure(situation, velocity, speed_m_s, now_s)
                at_most = 0
            for side in (R2, L2):
                looks.look_from(side, 1 + len(self._moments))
            looks.look_from(STICK, 1 if deflected else 0)
            self._look(situation, speed_m_s, now_s, at_most)
            self._next_s = min(self._measured_s, *map(min, filter(None, looks.looked_s))) + FIELD_PERIOD_S - _ROUNDING_S
        return looks

    def _measure(self, situation: Situation, velocity: FloatArray, speed_m_s: float, now_s: float) -> None:
        """Measure what moves the gripper besides the triggers; velocity (3,): of the tool."""
        pose = situation.pose
        self._measured_s = now_s
        self._sideways = sideways = Sideways(
            velocity - speed_m_s * pose.tool_rotation[:, 2],
            pose.tool_jacobian[3:] @ situation.joint_velocities_rad_s,
            self._fingers.see(pose, now_s),
        )
        able = along_approach(pose, self._limits, self._trigger_speed_m_s)
        until_s = stopping_s(situation, able)
        self._moments = sideways.moments(pose, until_s, until_s * able.full_speed_m_s)

    def _look(self, situation: Situation, speed_m_s: float, now_s: float, at_most: int) -> None:
        """Look at what has waited longest; more than `at_most` fields where they have waited too long."""
        due = self.looks.due(now_s, FIELD_PERIOD_S)
        if due[0][0] >= _FAR_BEHIND:
            at_most = len(due)
        elif due[0][0] >= _OVERDUE:
            at_most = 2
        for waited, side, place in due[:at_most]:
            if waited >= 1.0 - _ROUNDING:
                self._look_along(side, place, situation, speed_m_s, now_s)

    def _look_along(self, side: int, place: int, situation: Situation, speed_m_s: float, now_s: float) -> None:
        pose, sideways = situation.pose, self._sideways
        if place > 0 and sideways is not None:
            pose = sideways.moved(pose, self._moments[place - 1])
        (along, able, classes), scene = (
            self._prospect(side, situation, pose),
            self._surroundings.see(situation.objects),
        )
        if place > 0 and sideways is not None and sideways.moves_fingers:
            # What the fingers close on is what they are to touch.
            classes = np.where(classes == TARGET, PASSED_OVER, classes)
        widest_m = math.inf if situation.gap_m is None else 0.5 * max(situation.gap_m, 0.0)
        found = self.ahead.look(pose, scene, classes, along, widest_m)
        leads = place == 0 and side == (R2 if speed_m_s >= 0.0 else L2)
        if leads and now_s >= self._next_overlap_s:
            self._next_overlap_s = now_s + OVERLAP_PERIOD_S - _ROUNDING_S
            moved_m = abs(speed_m_s) * situation.loop_age_s * along.direction
            scratch, count = self.ahead.scratch, len(pose.sphere_radii_m)
            self._overlap_m3 = total_overlap_m3(
                scratch.spheres[:count], scene, classes, scratch.sigma_m[:count], moved_m
            )
        where = along.direction, pose.tool_position_m, found.ways_m
        overlap_m3 = self._overlap_m3 if leads else 0.0
        self.looks.add(side, place, now_s, *where, able, along.reach_m, found.sigma_m, overlap_m3)


def stopping_s(situation: Situation, able: Ability) -> float:
    """The time from a report until the arm stands. It goes at full speed; a person feels the report and lets go."""
    return situation.loop_age_s + HORIZON_S + able.full_speed_m_s / able.acceleration_m_s2
