"""An arm that remembers its commands and when it slowed down, by its own measurements."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import Arm, ArmState
from robot_side.simulation.joint_reference import MotionLimits

SLOWED = 0.05
"""An arm slower by this share than it just was has begun to decelerate."""
_CRUISE_S = 0.02
_STEP_S = 0.001
_LONGEST_WATCHED_S = 1.0
"""After a longer pause of this process the steps in between are left to the arm."""
_DECELERATION_RAD_S2 = MotionLimits().deceleration_rad_s2
_CRUISE_RAD_S = 0.05
"""Slower than this nothing is cruising."""


@dataclass(frozen=True)
class Deceleration:
    """One onset, after a stretch of even speed."""

    time_s: float
    """By the arm's measurement, to half a millisecond."""
    after_s: float
    """Time since the newest command was accepted; the gap limit is due."""


class WatchedArm:
    """An Arm in front of another one."""

    def __init__(self, arm: Arm, gap_s: float) -> None:
        self.speeds_rad_s: deque[tuple[float, float]] = deque(maxlen=100_000)
        """(when, the largest joint speed) of each state."""
        self.decelerations: deque[Deceleration] = deque(maxlen=10_000)
        self.told_to_move = 0
        """Commands that were not to stand still."""
        self.not_finite = 0
        """Commands that held NaN or infinity."""
        self._arm = arm
        self._gap_s = gap_s
        self._recent: deque[tuple[float, float]] = deque()
        self.accepted_s = 0.0
        """When the newest command that was not to stand still was accepted"""
        self._asked_s = self._measured_s = -math.inf

    @property
    def joint_count(self) -> int:
        """Do as the arm does."""
        return self._arm.joint_count

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Do as the arm does."""
        if np.any(joint_velocity_rad_s):
            self.told_to_move += 1
            self.accepted_s = valid_until_s - self._gap_s
        self.not_finite += not np.isfinite(joint_velocity_rad_s).all()
        self._arm.command(joint_velocity_rad_s, valid_until_s)

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Do as the arm does."""
        self._arm.command_gripper(closing, valid_until_s)

    def state(self, now_s: float) -> ArmState:
        """Do as the arm does."""
        moving = bool(self.speeds_rad_s) and self.speeds_rad_s[-1][1] > _CRUISE_RAD_S
        if moving and 0.0 < now_s - self._asked_s < _LONGEST_WATCHED_S:
            # Tick by tick, however late the caller is: the arm goes on by itself, and we are to see when it slows down.
            for step in range(1, int((now_s - self._asked_s) / _STEP_S)):
                self._watch(self._arm.state(self._asked_s + step * _STEP_S))
        self._asked_s = now_s
        state = self._arm.state(now_s)
        self._watch(state)
        return state

    def _watch(self, state: ArmState) -> None:
        if state.time_s <= self._measured_s:
            return
        self._measured_s = state.time_s
        speed = float(np.abs(state.joint_velocities_rad_s).max())
        self.speeds_rad_s.append((state.time_s, speed))
        recent = self._recent
        # All of the newest 20 ms, and the one before them.
        while len(recent) > 2 and state.time_s - recent[1][0] > _CRUISE_S:
            recent.popleft()
        fastest = max((past for _, past in recent), default=0.0)
        slowest = min((past for _, past in recent), default=0.0)
        steady = len(recent) > 1 and recent[-1][0] - recent[0][0] >= _CRUISE_S - _STEP_S
        cruising = steady and slowest > max(_CRUISE_RAD_S, (1.0 - SLOWED) * fastest)
        recent.append((state.time_s, speed))
        if cruising and speed < (1.0 - SLOWED) * fastest:
            # It has slowed down for a while by now, at a rate that is known.
            onset_s = state.time_s - (fastest - speed) / _DECELERATION_RAD_S2
            self.decelerations.append(Deceleration(onset_s, onset_s - self.accepted_s))
            recent.clear()
