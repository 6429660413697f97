"""Which field is looked at in a tick, and how much of it: so much and no more, so that all ticks take as long.

Fields take turns: R2, L2, and along the stick while that is deflected, each from where the gripper is and from where it
will have drifted, turned or closed its fingers to. The one that is due longest begins; where much is near it takes a
few ticks, and what it finds counts from where it began.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.reaction import HORIZON_S
from robot_side.ahead.field import ALL, Ahead, Along
from robot_side.ahead.find import PASSED_OVER, TARGET
from robot_side.ahead.law import Situation
from robot_side.ahead.looks import L2, R2, STICK, Looks
from robot_side.ahead.scene_table import SceneTable, scene_table
from robot_side.ahead.sideways import FingerMotion, Sideways
from robot_side.ahead.total_overlap import looked_overlap_m3
from robot_side.arm.ability import Ability, JointLimits, along_approach
from robot_side.arm.port import GripperPose

FIELD_PERIOD_S: Final = 0.01
"""A controller is written to no more often."""
_ROUNDING_S: Final = 1e-9
_OVERDUE: Final = 1.5
"""While something is so many periods old, twice as much is done in a tick,"""
_FAR_BEHIND: Final = 5.0
"""and while something is so old, or was never looked at, all that is due, however long that takes; so it is, too, where
each tick has other objects, so that no look would come to its end."""
MOST_WORK: Final = 700
"""In a tick, in ramps and nodes (see `Ahead.go_on`): some 85 microseconds. With less, looks are spread over more than
half of the ticks, so that the median rises; with more the longest ticks last longer."""
TO_BEGIN: Final = 150
"""To begin a look, or to measure what moves the gripper, takes as long as so many."""


class Prospect(NamedTuple):
    """How to look along one side: the errors there, what the joints give there, and what each object is (k,)."""

    along: Along
    able: Ability
    standing: IntArray


@dataclass(frozen=True)
class _Look:
    """A look under way, and where and when it began."""

    side: int
    place: int
    situation: Situation
    pose: GripperPose
    scene: SceneTable
    prospect: Prospect
    moved_m: FloatArray | None
    """(3,) |v| t_d û, along the side on which the gripper goes"""
    began_s: float


class Turns:
    """Keeps what was seen, and goes on looking."""

    def __init__(
        self,
        ahead: Ahead,
        prospect: Callable[[int, Situation, GripperPose], Prospect],
        limits: JointLimits,
        trigger_speed_m_s: float,
    ) -> None:
        self.ahead = ahead
        self._prospect = prospect
        self._limits = limits
        self._trigger_speed_m_s = trigger_speed_m_s
        self.looks = Looks()
        self._going: _Look | None = None
        self._given_up = 0
        """Looks since the last that came to its end"""
        self._fingers = FingerMotion()
        self._sideways: Sideways | None = None
        self._moments: tuple[float, ...] = ()
        """After which to look from where `_sideways` leads"""
        self._measured_s = -math.inf
        self._next_s = -math.inf
        """When there is something to do again, at the earliest"""

    def take(self, situation: Situation, now_s: float) -> Looks:
        """Do what is to be done in this tick; what has been seen so far. The first tick looks at everything."""
        # What is gripped or let go changes which spheres there are.
        changed = self._sideways is None or len(self._sideways.own_m_s) != len(situation.pose.sphere_radii_m)
        looks, deflected = self.looks, situation.lateral != (0.0, 0.0)
        if now_s >= self._next_s or changed or deflected != bool(looks.looked_s[STICK]):
            velocity = situation.pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s
            speed_m_s = float(velocity @ situation.pose.tool_rotation[:, 2])
            left = MOST_WORK
            if changed or now_s - self._measured_s >= FIELD_PERIOD_S - _ROUNDING_S:
                self._measure(situation, velocity, speed_m_s, now_s)
                left -= TO_BEGIN
            for side in (R2, L2):
                looks.look_from(side, 1 + len(self._moments))
            looks.look_from(STICK, 1 if deflected else 0)
            self._look(situation, speed_m_s, now_s, left, changed=changed)
            due_s = min(self._measured_s, *map(min, filter(None, looks.looked_s))) + FIELD_PERIOD_S - _ROUNDING_S
            self._next_s = due_s if self._going is None else now_s
        return looks

    def _measure(self, situation: Situation, velocity: FloatArray, speed_m_s: float, now_s: float) -> None:
        """What moves the gripper besides the triggers; velocity (3,): of the tool."""
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

    def _look(self, situation: Situation, speed_m_s: float, now_s: float, left: int, *, changed: bool) -> None:
        """Go on with the look under way, then with what is due longest; left: so much may be done."""
        if self._going is not None and (changed or self._is_gone(self._going, situation)):
            self._going = None
            self._given_up += 1
        due = self.looks.due(now_s)
        if due[0][0] >= _FAR_BEHIND * FIELD_PERIOD_S or self._given_up > 1:
            left = ALL
        elif due[0][0] >= _OVERDUE * FIELD_PERIOD_S:
            left *= 2
        going = self._going
        if going is not None:
            left -= self._go_on(left)
        for ago_s, side, place in due:
            if self._going is not None or left < TO_BEGIN or ago_s < FIELD_PERIOD_S - _ROUNDING_S:
                break
            if going is None or (going.side, going.place) != (side, place):
                self._begin(side, place, situation, speed_m_s, now_s)
                left -= TO_BEGIN + self._go_on(max(left - TO_BEGIN, 1))
                if due[0][0] < _OVERDUE * FIELD_PERIOD_S:
                    break

    def _is_gone(self, going: _Look, situation: Situation) -> bool:
        """Whether a look under way is at what is no longer there."""
        then = going.situation
        places = len(self.looks.looked_s[going.side])
        return then.objects is not situation.objects or then.held != situation.held or going.place >= places

    def _begin(self, side: int, place: int, situation: Situation, speed_m_s: float, now_s: float) -> None:
        pose, sideways = situation.pose, self._sideways
        if place > 0 and sideways is not None:
            pose = sideways.moved(pose, self._moments[place - 1])
        prospect, scene = self._prospect(side, situation, pose), scene_table(situation.objects)
        along, standing = prospect.along, prospect.standing
        if place > 0 and sideways is not None and sideways.moves_fingers:
            # What the fingers close on is what they are to touch.
            standing = np.where(standing == TARGET, PASSED_OVER, standing)
            prospect = prospect._replace(standing=standing)
        moved_m = None
        if place == 0 and side == (R2 if speed_m_s >= 0.0 else L2):
            moved_m = abs(speed_m_s) * situation.loop_age_s * along.direction
        self.ahead.begin(pose, scene, standing, along, math.inf if situation.gap_m is None else 0.5 * situation.gap_m)
        # Only what could begin is under way: what is not finite is refused.
        self._going = _Look(side, place, situation, pose, scene, prospect, moved_m, now_s)

    def _go_on(self, most: int) -> int:
        """How much has been done."""
        going, ahead = self._going, self.ahead
        before, found = ahead.work, ahead.go_on(most)
        if going is None or found is None:
            return ahead.work - before
        self._going, self._given_up = None, 0
        overlap_m3, (along, able, standing) = 0.0, going.prospect
        if going.moved_m is not None:
            spheres = len(going.pose.sphere_radii_m)
            overlap_m3 = looked_overlap_m3(going.moved_m, spheres, going.scene, standing, self.ahead.tables)
        where = along.direction, going.pose.tool_position_m, found.ways_m
        self.looks.add(
            *(going.side, going.place, going.began_s), *where, able, along.reach_m, found.sigma_m, overlap_m3
        )
        return ahead.work - before


def stopping_s(situation: Situation, able: Ability) -> float:
    """From a report until the arm stands, which went at full speed and was told to stop by what is felt of it."""
    return situation.loop_age_s + HORIZON_S + able.full_speed_m_s / able.acceleration_m_s2
