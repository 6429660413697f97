"""Looks of one tick: along each side from the present pose, from waypoints on the path, and from the map's probes."""

from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.around import PROBES
from robot_side.field.field import Ahead, Field
from robot_side.field.scratch import MOST_WORK, Count
from robot_side.laws.around import RETREATS_M_S, ProbeLooks, probe
from robot_side.laws.classes import Classes
from robot_side.laws.gripper_motion import GripperMotion
from robot_side.laws.path import Drift, Waypoint, times_ahead_s, waypoints
from robot_side.laws.prospect import Assumed, Prospect, prospect, stopping_s
from robot_side.laws.recent_looks import Newest, RecentLooks
from robot_side.laws.unknown import UnknownAhead
from robot_side.laws.vicinity import farthest_m, nothing_within
from robot_side.surroundings.scene_table import SceneTable
from robot_side.tick.sensed import L2, R2, STICK
from robot_side.tick.situation import Situation

_SELDOM_S: Final = 0.03
"""Period of looks along the trigger against which the gripper moves"""
_ROUNDING_S: Final = 1e-9
_NOTHING: Final[FloatArray] = np.zeros(3)


class Seen(NamedTuple):
    """Situation that one tick looks at, and what follows from it."""

    situation: Situation
    motion: GripperMotion
    assumed: Assumed
    classes: Classes
    scene: SceneTable
    now_s: float
    passed_s: float
    """Time since the last tick that looked; infinite in the first"""

    def prospect(self, side: int, waypoint: Waypoint | None = None) -> Prospect:
        """Return the prospect of a look along one side; without a waypoint, from the present pose."""
        closes = waypoint is not None and self.motion.fingers_m_s is not None
        classes = self.classes.closing if closes else self.classes.usual
        return prospect(side, self.situation, self.motion.ahead_m_s, classes, self.assumed, waypoint)


@dataclass
class Looking:
    """Maker of the looks, with the recent ones along each side."""

    ahead: Ahead
    probes: ProbeLooks | None
    """Looks for the map; None if nobody asks for it"""
    sides: tuple[RecentLooks, ...] = field(default_factory=lambda: tuple(RecentLooks() for _ in (R2, L2, STICK)))
    newest: dict[int, Newest] = field(default_factory=dict)
    """Newest look along each side from the present pose"""
    looks: int = 0
    with_nothing_near: int = 0
    """Looks in which no sphere touched an object within the examined distance"""
    cut: Field | None = None
    """Result of the newest tick's further looks, once its looks had done more than `MOST_WORK`; None if they had not"""
    work: IntArray = field(default_factory=lambda: np.zeros(len(Count), dtype=np.int64))
    """Counts of the looks' work, indexed by `Count`"""
    pairs: int = 0
    """Gripper spheres times primitives, over all looks"""
    at_full_rate: int = 0
    """Number of looks if each tick made all of them; see `pass_tick`"""
    unknown: UnknownAhead = field(init=False)
    _done: int = 0
    _clear: bool | None = None
    """Whether nothing is near in the newest tick that looked (see `vicinity`); None if no look depended on it"""

    def __post_init__(self) -> None:
        self.unknown = UnknownAhead(self.ahead.encoder_sigma_rad)

    def look(self, seen: Seen, *, changed: bool) -> None:
        """Make the looks of one tick. changed: whether the situation has changed, or objects have moved."""
        situation, motion = seen.situation, seen.motion
        self.cut, self._clear, self._done = None, None, 0
        deflected, traced = situation.lateral != (0.0, 0.0), situation.compensation == "operator"
        for side in (R2, L2):
            leads = motion.ahead_m_s > -RETREATS_M_S if side == R2 else motion.ahead_m_s < RETREATS_M_S
            if changed or leads or seen.now_s - self.newest[side].at_s + _ROUNDING_S >= _SELDOM_S:
                self._look_from_here(side, seen)
        if deflected:
            self._look_from_here(STICK, seen)
        else:
            self.sides[STICK].forget()
        until_s = stopping_s(self.newest[R2].able, situation.loop_age_s)
        # The operator side traces the sticks' motion through the map; then only the fingers' is looked along.
        on_map = traced and self.probes is not None and self.probes.known
        self._look_from_waypoints(seen, until_s, traced=on_map)
        if self.probes is not None:
            self.probes.begin(until_s, seen.now_s, traced=traced, moved=changed or motion.moves)
            due = self.probes.due(motion, seen.passed_s)
            if due and self._nothing_near(seen):
                self.probes.pass_over(due)
            else:
                self._look_from_probes(self.probes, due, seen)
        self.pass_tick(seen)

    def _nothing_near(self, seen: Seen) -> bool:
        if self._clear is None:
            unknown = seen.situation.objects.unknown
            reach_m = farthest_m(seen.situation, seen.motion, seen.assumed, self.ahead.encoder_sigma_rad)
            tool_m = seen.situation.pose.tool_position_m
            known = self.cut is None and (unknown is None or not len(unknown.boxes_m))
            self._clear = known and nothing_within(seen.scene, seen.classes.usual, tool_m, reach_m)
        return self._clear

    def pass_tick(self, seen: Seen) -> None:
        """Count the looks that the tick would make at the full rate: along each side, from all waypoints and probes."""
        self.at_full_rate += 2 + (seen.situation.lateral != (0.0, 0.0))
        self.at_full_rate += self.sides[R2].waypoints + self.sides[L2].waypoints
        if self.probes is not None and self.probes.traced:
            self.at_full_rate += 2 * PROBES

    def look_around(self, seen: Seen) -> None:
        """Look from all probes."""
        if self.probes is not None:
            until_s = stopping_s(seen.prospect(R2).able, seen.situation.loop_age_s)
            self.probes.begin(until_s, seen.now_s, traced=True, moved=True)
            self.at_full_rate += 2 * PROBES
            self._look_from_probes(self.probes, [(side, one) for side in (R2, L2) for one in range(PROBES)], seen)

    def _look_from_probes(self, probes: ProbeLooks, due: list[tuple[int, int]], seen: Seen) -> None:
        for side, number in due:
            there = probe(number, seen.situation.pose, seen.assumed.motion, probes.full_s)
            probes.add(side, number, *self._one(seen.prospect(side, there), seen, full_only=True)[1:])

    def _one(
        self, found: Prospect, seen: Seen, *, full_only: bool = False
    ) -> tuple[Field, FloatArray, float, FloatArray]:
        """Look; return the field, û, the tool's position along û, and the onset distances (2, 8) from the tool."""
        pose, classes, along, widest_m = found.asked
        # What was too much is not tried again in the same tick.
        made = self.cut or self.ahead.look(pose, seen.scene, classes, along, widest_m, full_only=full_only)
        self._done += int(made.counts[Count.PAIRS] + made.counts[Count.OVERLAPS])
        if self.cut is None and self._done > MOST_WORK:
            cut = np.zeros_like(made.counts)
            cut[Count.CUT] = 1
            self.cut = Field(np.zeros_like(made.onsets_m), made.sigmas_m, cut)
        self.work += made.counts
        self.looks += 1
        self.pairs += len(pose.sphere_radii_m) * len(seen.scene.kinds)
        self.with_nothing_near += int(made.counts[Count.PAIRS] == 0)
        direction = found.asked.along.direction
        began_m = float(direction @ seen.situation.pose.tool_position_m)
        both_m = self.unknown.with_unknown_m(made.onsets_m, found.asked, seen.situation.objects.unknown)
        return made, direction, began_m, found.from_tool_m(both_m)

    def _look_from_here(self, side: int, seen: Seen) -> None:
        found = seen.prospect(side)
        made, direction, began_m, onsets_m = self._one(found, seen)
        self.sides[side].add(0, seen.now_s, direction, began_m, onsets_m)
        self.newest[side] = Newest(seen.now_s, direction, began_m, found.asked.along.reach_m, found.able, made.sigma_m)

    def _look_from_waypoints(self, seen: Seen, until_s: float, *, traced: bool) -> None:
        """Look along R2 and L2 from the waypoints on the gripper's path that are new, or due."""
        pose, motion, times_s = seen.situation.pose, seen.motion, tuple[float, ...]()
        drift = Drift(_NOTHING, _NOTHING, motion.fingers_m_s)
        if not traced:
            aside_m_s = motion.linear_m_s - motion.ahead_m_s * pose.tool_rotation[:, 2]
            drift = Drift(aside_m_s, motion.turning_rad_s, motion.fingers_m_s)
        if motion.moves and not (traced and motion.fingers_m_s is None):
            times_s = times_ahead_s(pose, drift, until_s, until_s * self.newest[R2].able.full_speed_m_s)
        for side in (R2, L2):
            looks = self.sides[side]
            if times_s or looks.waypoints:
                ahead = waypoints(drift, times_s, looks.nearest(len(times_s)))
                looks.keep_up_to(len(ahead))
                due = looks.due(seen.passed_s, seen.now_s)
                if due and not looks.found and self._nothing_near(seen):
                    looks.pass_over(due, seen.now_s)
                    continue
                for number in due:
                    found = seen.prospect(side, ahead[number - 1])
                    looks.add(number, seen.now_s, *self._one(found, seen)[1:])
