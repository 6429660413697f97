"""Coarse map of onset distances around the gripper, for an operator side that traces the gripper's path.

The operator side knows the sticks' deflection one loop age before the robot side does. It traces the path through the
map (`operator_side/feel/path_ahead.py`). A probe is a pose of the gripper from which looks are made: the present pose,
or one that a fully deflected stick leads to (`Around`). Each probe keeps the onset distances of full strength only, of
the fast and the slow list.
"""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.around import ACROSS, LISTS, LONGEST_S, PERIOD_S, PROBES, TURNED
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.laws.gripper_motion import GripperMotion
from robot_side.laws.path import Drift, Waypoint
from robot_side.tick.sensed import L2, R2, Sensed

RETREATS_M_S: Final = 0.01
"""Speed along the approach axis, forwards or backwards, below which both triggers count as the one that moves the
gripper"""
_SELDOM: Final = 4.0
"""Period of a probe's looks along the trigger against which the gripper moves, in periods of the other trigger's"""
_HOLDS_S: Final = 1.5
"""Age at which a probe's look expires while something moves. It is long because looks from probes come late if ticks
are rare."""
_SAME_TIME: Final = 0.05
"""Largest relative change of T, the time until the arm stands, after which the probes' looks still count"""
_ANEW_S: Final = 0.1
"""Time in which discarded looks are made again"""
_LATE_S: Final = 0.02
"""Longest pause that one tick makes up for, so that no tick takes much longer than others"""
_ROUNDING: Final = 1e-6


def probe(number: int, pose: GripperPose, motion: ToolMotionSettings, full_s: float) -> Waypoint:
    """Return the pose of a probe, 0 to PROBES - 1, as a waypoint. full_s: T, the time until the arm stands."""
    if number == 0:
        return Waypoint(Drift(np.zeros(3), np.zeros(3)), 0.0, 0.0)
    quarter, part = divmod(number - 1, ACROSS + TURNED)
    right, up = (1.0 - quarter, 0.0) if quarter % 2 == 0 else (0.0, 2.0 - quarter)
    x, y = pose.tool_rotation[:, 0], pose.tool_rotation[:, 1]
    if part < ACROSS:
        drift, step_s, steps = Drift(motion.stick_speed_m_s * (right * x - up * y), np.zeros(3)), full_s / ACROSS, part
    else:
        turning = motion.turn_speed_rad_s * (up * x + right * y)
        drift, step_s, steps = Drift(np.zeros(3), turning), full_s / TURNED, part - ACROSS
    return Waypoint(drift, (steps + 1.0) * step_s, (steps + 0.5) * step_s)


@dataclass
class ProbeLooks:
    """Newest look from each probe along R2 and L2, and since when these looks count."""

    full_s: float = 0.0
    """T for which the looks were made"""
    _since_s: float = math.inf
    """Time from which on looks count; infinite while none does"""
    _moved_s: float = -math.inf
    """When anything last moved"""
    _now_s: float = -math.inf
    """Time of the newest tick"""
    _at_s: FloatArray = field(default_factory=lambda: np.full((2, PROBES), -np.inf))
    _direction: FloatArray = field(default_factory=lambda: np.zeros((2, PROBES, 3)))
    _began_m: FloatArray = field(default_factory=lambda: np.zeros((2, PROBES)))
    _onsets_m: FloatArray = field(default_factory=lambda: np.full((2, 2, PROBES), np.inf))
    """Onset distances of full strength: along R2 and L2, fast and slow list"""

    def discard(self) -> None:
        """Discard all looks, because the objects' classes or P have changed."""
        self._since_s = math.inf

    def advance(self, now_s: float) -> None:
        """Set the present time, to which approaching objects are carried."""
        self._now_s = now_s

    def begin(self, until_s: float, now_s: float, *, traced: bool, moved: bool) -> None:
        """Begin a tick. Discard the looks if T has changed to another `until_s`.

        traced: whether the operator side traces the map; if not, no look counts. moved: whether anything moves.
        """
        self._now_s = now_s
        if not traced:
            self._since_s = math.inf
        elif self._since_s == math.inf or abs(until_s - self.full_s) > _SAME_TIME * self.full_s:
            self._since_s, self.full_s, moved = now_s, until_s, True
        if moved:
            self._moved_s = now_s

    @property
    def traced(self) -> bool:
        """Whether the operator side traces the map"""
        return self._since_s < math.inf

    @property
    def known(self) -> bool:
        """Whether the map is valid: all looks count, and are recent or made since the last motion."""
        old = (self._at_s <= self._moved_s) & (self._at_s < self._now_s - _HOLDS_S)
        return bool(((self._at_s >= self._since_s) & ~old).all()) and 0.0 < self.full_s <= LONGEST_S

    @property
    def waits(self) -> bool:
        """Whether discarded looks are to be made again."""
        return self.traced and bool((self._at_s < self._since_s).any())

    def due(self, motion: GripperMotion, passed_s: float) -> list[tuple[int, int]]:
        """Return side and number of the probes to look from: those that waited longest, as many as fit `passed_s`.

        All of them in the first tick, where `passed_s` is infinite.
        """
        if not self.traced:
            return []
        leads = np.array([[motion.ahead_m_s > -RETREATS_M_S], [motion.ahead_m_s < RETREATS_M_S]])
        waited = (self._now_s - self._at_s) / np.where(leads, PERIOD_S, _SELDOM * PERIOD_S)
        waited[self._at_s > self._moved_s] = -np.inf
        # A discarded look is due again at once: until then the operator side has the old map.
        waited[self._at_s < self._since_s] = np.inf
        share = min(passed_s, _LATE_S) / (_ANEW_S if self.waits else PERIOD_S)
        most = math.ceil(2.0 * PROBES * share) if math.isfinite(passed_s) else 2 * PROBES
        first = np.argsort(-waited, axis=None, kind="stable")[:most]
        return [divmod(one, PROBES) for one in first.tolist() if waited.flat[one] >= 1.0 - _ROUNDING]

    def add(self, side: int, number: int, direction: FloatArray, began_m: float, onsets_m: FloatArray) -> None:
        """Store a probe's newest look. onsets_m (2, 8): fast and slow list."""
        self._at_s[side, number], self._direction[side, number] = self._now_s, direction
        self._began_m[side, number], self._onsets_m[side, :, number] = began_m, onsets_m[:, -1]

    def pass_over(self, due: list[tuple[int, int]]) -> None:
        """Note that looks from these probes, by side and number, would find nothing."""
        for side, number in due:
            self._at_s[side, number], self._onsets_m[side, :, number] = self._now_s, np.inf

    def onsets_m(self, pose: GripperPose, sensed: Sensed, velocities_m_s: FloatArray) -> FloatArray:
        """Return the map's onset distances (LISTS, PROBES) from the tool's present pose.

        sensed: the tick's field. velocities_m_s (k, 3): those of the objects that are felt.
        """
        found_m = np.empty((2, 2, PROBES))
        for side, ahead in ((R2, sensed.r2), (L2, sensed.l2)):
            approach = pose.tool_rotation[:, 2] if side == R2 else -pose.tool_rotation[:, 2]
            gone_m = self._direction[side] @ pose.tool_position_m - self._began_m[side]
            # A look includes the objects' motion until the gripper stops, but not their motion since the look.
            closing_m_s = max(float(-(velocities_m_s @ approach).min(initial=0.0)), 0.0)
            gone_m += closing_m_s * (self._now_s - self._at_s[side])
            found_m[side] = self._onsets_m[side] - gone_m
            # Straight ahead the present field knows more: new objects and the motion of the fingers.
            for kind, newest_m in enumerate((ahead.fast_m[-1], ahead.slow_m[-1])):
                if newest_m < sensed.horizon_m:
                    found_m[side, kind, 0] = min(found_m[side, kind, 0], newest_m)
        return found_m.reshape(LISTS, PROBES)
