"""Recent looks along one side. The shortest of their onset distances count, each less the tool's motion since the look.

If the tool has only translated since, the subtraction is exact.
"""

import math
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.arm.ability import Ability
from robot_side.laws.path import EVEN_WAYPOINTS
from robot_side.tick.sensed import STRENGTHS

STEADY_S: Final = 0.1
"""Time for which a look's onset distances count. The operator side also lets a trigger's strength fall over 0.1 s."""
WAYPOINT_PERIOD_S: Final = 0.03
"""Period of the looks from each waypoint on the path"""
_SAME_DIRECTION: Final = 0.999
"""Cosine of the largest angle, 2.6°, at which two looks count as along the same direction"""
_MOST_WAYPOINTS: Final = EVEN_WAYPOINTS + 2
ROOM: Final = 64
"""Capacity; if it is used up, the oldest look is replaced"""


class Newest(NamedTuple):
    """Newest look along one side from the gripper's present pose."""

    at_s: float
    direction: FloatArray
    """(3,) unit vector û"""
    began_m: float
    """The tool's position along û at the time of the look"""
    reach_m: float
    """Distance examined"""
    able: Ability
    sigma_m: float
    """Largest D_σ"""

    def known_m(self, tool_m: FloatArray) -> float:
        """Return the distance ahead of the tool (3,) that the look still covers."""
        return self.reach_m - (float(self.direction @ tool_m) - self.began_m)


@dataclass
class RecentLooks:
    """Looks along one side from the present pose, which is waypoint 0, and from those ahead, 1 and so on."""

    waypoints: int = 0
    """Number of waypoints ahead"""
    _at_s: FloatArray = field(default_factory=lambda: np.full(ROOM, -np.inf))
    """Time of each look; minus infinity for a free row"""
    _waypoint: IntArray = field(default_factory=lambda: np.zeros(ROOM, dtype=np.int64))
    _direction: FloatArray = field(default_factory=lambda: np.zeros((ROOM, 3)))
    _reached_m: FloatArray = field(default_factory=lambda: np.full((ROOM, 2 * STRENGTHS), np.inf))
    """Onset distances, fast and slow list, plus the tool's position along û: where on û each strength begins"""
    _looked_s: FloatArray = field(default_factory=lambda: np.full(1 + _MOST_WAYPOINTS, -np.inf))
    """Time of the last look from each waypoint"""
    _nearest_m: FloatArray = field(default_factory=lambda: np.full(1 + _MOST_WAYPOINTS, np.inf))
    """Onset distance of full strength (fast list) in the last look from each waypoint"""

    def keep_up_to(self, waypoints: int) -> None:
        """Set the number of waypoints ahead; forget the looks from any further ones."""
        if waypoints < self.waypoints:
            self._forget(self._waypoint > waypoints)
            self._looked_s[waypoints + 1 :], self._nearest_m[waypoints + 1 :] = -np.inf, np.inf
        self.waypoints = waypoints

    def forget(self) -> None:
        """Forget all looks."""
        if self._looked_s[0] > -np.inf:
            self._forget(self._waypoint >= 0)
            self._looked_s[:], self._nearest_m[:] = -np.inf, np.inf

    def due(self, passed_s: float, now_s: float) -> list[int]:
        """Return the waypoints ahead to look from: all that are new, and the share that is due after `passed_s`."""
        if self.waypoints == 0:
            return []
        waited_s = now_s - self._looked_s[1 : self.waypoints + 1]
        share = math.ceil(self.waypoints * min(passed_s / WAYPOINT_PERIOD_S, 1.0))
        first = 1 + np.argsort(-waited_s, kind="stable")[: max(share, int(np.isinf(waited_s).sum()))]
        return [int(number) for number in first]

    def nearest(self, even: int) -> int:
        """Return which of the waypoints 0 to `even` has the shortest onset distance of full strength."""
        return int(self._nearest_m[: even + 1].argmin())

    def add(self, waypoint: int, now_s: float, direction: FloatArray, began_m: float, onsets_m: FloatArray) -> None:
        """Store a look. onsets_m (2, 8): fast and slow list, from the tool's present position.

        Earlier looks from the same waypoint are forgotten if they are older than STEADY_S or along another direction.
        """
        # Each list ascends. Where nothing was found before, nothing more is to be remembered.
        if onsets_m[0, 0] == onsets_m[1, 0] == np.inf and not self.found:
            self.pass_over([waypoint], now_s)
            return
        old = (self._at_s <= now_s - STEADY_S) | (self._direction @ direction <= _SAME_DIRECTION)
        self._forget(old & (self._waypoint == waypoint))
        row = int(self._at_s.argmin())
        self._at_s[row], self._waypoint[row], self._direction[row] = now_s, waypoint, direction
        self._reached_m[row] = onsets_m.ravel() + began_m
        self._looked_s[waypoint], self._nearest_m[waypoint] = now_s, onsets_m[0, -1]

    @property
    def found(self) -> bool:
        """Whether any look that counts has found something"""
        return bool((self._reached_m < np.inf).any())

    def pass_over(self, waypoints: list[int], now_s: float) -> None:
        """Note that looks from these waypoints find nothing; only while none has `found` anything."""
        self._looked_s[waypoints], self._nearest_m[waypoints] = now_s, np.inf

    def shortest_m(self, tool_m: FloatArray) -> FloatArray:
        """Return the shortest onset distances (2, 8) from the tool's present position (3,); infinite without looks."""
        shortest_m: FloatArray = (self._reached_m - (self._direction @ tool_m)[:, None]).min(axis=0)
        return shortest_m.reshape(2, STRENGTHS)

    def _forget(self, rows: BoolArray) -> None:
        self._at_s[rows], self._reached_m[rows] = -np.inf, np.inf
