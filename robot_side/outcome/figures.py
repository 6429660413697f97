"""Figures of the robot side in one run, collected tick by tick for the summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from common.arrays import FloatArray
from common.episode import EpisodeMark
from common.roles import Role
from common.statistics import BLOCK, RunningStatistics
from robot_side.outcome.placing import Placing, scaled
from robot_side.tick.events import Listener, Tick
from robot_side.tick.explained import Overlapping
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

if TYPE_CHECKING:
    from robot_side.tick.truth import ContactOnset, Truth

TRUTH_PERIOD_S = 0.01
OVERLAP_PERIOD_S = 0.1
MOVING_M_S = 0.01
"""Speed above which the tool counts as moving."""
_CONTACT_REST_S = 0.1
"""Time, in seconds, within which a repeated contact with an object counts as the same contact, on any part of the
gripper: a sliding touch chatters, and two fingers do not close simultaneously."""


_MOST_ROWS = 8 * BLOCK
"""Maximum number of ticks that wait to be evaluated"""


class RunFigures(Listener):
    """Statistics over the ticks of a run; control never reads them."""

    def __init__(self, seed: int = 0, truth: Observer | None = None, enlarged: Overlapping | None = None) -> None:
        """truth: observer of the simulation; None if there is none. enlarged: gripper whose overlap is a figure."""
        self.ticks = 0
        self.overlap_m3: float | None = None
        """Newest volume that the enlarged gripper shares with objects; None before the loop age is known"""
        self._enlarged = enlarged
        self._next_overlap_s = -np.inf
        self._situation: Situation | None = None
        """Newest situation with a known loop age that `overlap_m3` is not of"""
        self._observer = truth
        self._knows_truth = truth is not None
        self._start_s: float | None = None
        self._next_truth_s = -np.inf
        self._loop_age = RunningStatistics(seed)
        self._rows: list[tuple[Sensed, bool, bool]] = []
        """Results of the newest ticks, each with whether the arm was armed and the loop age settled"""
        self._enlargement = RunningStatistics(seed)
        self._enlargement_moving = RunningStatistics(seed)
        self._overlap = RunningStatistics(seed)
        self._l2 = RunningStatistics(seed)
        self._r2 = RunningStatistics(seed)
        self._min_distance_m: float | None = None
        self._min_obstacle_distance_m: float | None = None
        self._first_contact: dict[str, Any] | None = None
        self._touched_s: dict[str, float] = {}
        self._contacts: dict[str, int] = {}
        self._obstacle_contacts = 0
        self._armed_s: float | None = None
        self._grasped_s: float | None = None
        self._rest_height_m: float | None = None
        self._lifted_m = 0.0
        self._placing = Placing()
        self._held = False
        self._warns = False
        """Whether the newest tick has any stiffness or rumble"""
        self._unread: list[Tick] = []

    def on_tick(self, tick: Tick) -> None:
        """Store the tick until its messages have left."""
        if self._start_s is None:
            self._start_s = tick.now_s
        self._unread.append(tick)

    def on_episode(self, mark: EpisodeMark, now_s: float) -> None:
        """Forget what was lifted and placed once the scene was put back."""
        del now_s
        if mark == "reset":
            self._read()
            self._placing, self._held = Placing(), False

    def on_sent(self, now_s: float) -> None:
        """Evaluate the stored ticks in blocks, which is cheaper than one by one, and observe the truth."""
        self._read()
        if len(self._rows) >= BLOCK:
            self._take_in()
        if self._enlarged is not None and self._situation is not None and now_s >= self._next_overlap_s:
            self._next_overlap_s = now_s + OVERLAP_PERIOD_S - 1e-9
            self.overlap_m3 = self._enlarged.overlap_m3(self._situation)
            self._overlap.add(self.overlap_m3)
            self._situation = None
        if self._observer is not None:
            if not self.touched and (onset := self._observer.contact()) is not None:
                self.first_contact(onset, now_s)
            if now_s >= self._next_truth_s:
                self._next_truth_s = now_s + TRUTH_PERIOD_S
                self.truth(self._observer.observe(), self._observer.roles, now_s)

    @property
    def placed(self) -> bool | None:
        """Whether the target was lifted and stands by itself; None without a simulation"""
        return self._placing.placed if self._knows_truth else None

    def since_start_s(self, time_s: float) -> float:
        """Return the time since the first tick."""
        return time_s - (self._start_s or 0.0)

    def _read(self) -> None:
        """Take the stored ticks, except failed ticks."""
        for tick in self._unread:
            if (found := tick.found) is None:
                continue
            armed = found.motion_state == "armed"
            if found.situation.loop_age_known:
                self._loop_age.add(found.situation.loop_age_s)
                # Where there was too much to look at, its volume would take too long, too.
                self._situation = None if found.sensed.cut else found.situation
            self.tick(found.sensed, armed=armed, settled=found.situation.loop_age_settled)
            self.task(armed, found.holds_target, found.target_m, tick.now_s)
        self._unread.clear()

    def tick(self, sensed: Sensed, *, armed: bool = True, settled: bool = True) -> None:
        """Add a tick's enlargement and stiffness.

        Stiffness counts as 0 unless the arm is armed, as nobody feels it. settled: whether the loop age is; until then
        the enlargement is unknown.
        """
        self._warns = max(sensed.rumble, sensed.l2.course_stiffness, sensed.r2.course_stiffness) > 0.0
        self._rows.append((sensed, armed, settled))
        self.ticks += 1
        if len(self._rows) == _MOST_ROWS:
            self._take_in()

    def _take_in(self) -> None:
        rows, self._rows = self._rows, []
        self._enlargement.extend([sensed.enlargement_m for sensed, _, settled in rows if settled])
        self._enlargement_moving.extend(
            [sensed.enlargement_m for sensed, _, settled in rows if settled and sensed.tool_speed_m_s > MOVING_M_S]
        )
        self._l2.extend([armed * sensed.l2.course_stiffness for sensed, armed, _ in rows])
        self._r2.extend([armed * sensed.r2.course_stiffness for sensed, armed, _ in rows])

    def truth(self, truth: Truth, roles: Mapping[str, Role], now_s: float) -> None:
        """Add true distances and contacts from the simulation; count the contacts that begin."""
        self._knows_truth = True
        self._min_distance_m = _smaller(self._min_distance_m, truth.min_distance_m)
        self._min_obstacle_distance_m = _smaller(self._min_obstacle_distance_m, truth.min_obstacle_distance_m)
        for name in {name for _, name in truth.contacts}:
            if now_s - self._touched_s.get(name, -np.inf) > _CONTACT_REST_S:
                self._contacts[name] = self._contacts.get(name, 0) + 1
                self._obstacle_contacts += roles[name] is Role.OBSTACLE
            self._touched_s[name] = now_s
        if truth.target is not None:
            self._placing.observe(truth.target, self._held, self._warns, now_s)

    @property
    def touched(self) -> bool:
        """Whether there has been a contact with an object that is no support"""
        return self._first_contact is not None

    def first_contact(self, onset: ContactOnset, now_s: float) -> None:
        """Store the gripper's first contact with an object that is no support."""
        speed_mm_s = 1e3 * onset.closing_speed_m_s
        self._first_contact = {"with": onset.thing, "speed_mm_s": speed_mm_s, "time_s": self.since_start_s(now_s)}

    def task(self, armed: bool, held: bool, target_center_m: FloatArray | None, now_s: float) -> None:
        """Update the task's progress: armed, grasped, lifted. target_center_m: (3,) as perceived."""
        self._held = held
        if armed and self._armed_s is None:
            self._armed_s = now_s
        if held and self._grasped_s is None:
            self._grasped_s = now_s
        if target_center_m is not None:
            height_m = float(target_center_m[2])
            # Height at which the target last stood: another target, or a pushed one, stands elsewhere.
            if not held or self._rest_height_m is None:
                self._rest_height_m = height_m
            self._lifted_m = max(self._lifted_m, height_m - self._rest_height_m)

    def summary(self) -> dict[str, Any]:
        """Return the part of the run's summary that comes from these figures, in the units that the keys name."""
        self._read()
        self._take_in()
        grasp_s = None
        if self._grasped_s is not None and self._armed_s is not None:
            grasp_s = self._grasped_s - self._armed_s
        return {
            "ticks": self.ticks,
            "enlargement_mm": {
                "min": scaled(self._enlargement.minimum, 1e3),
                "mean": scaled(self._enlargement.mean, 1e3),
                "max": scaled(self._enlargement.maximum, 1e3),
                "mean_moving": scaled(self._enlargement_moving.mean, 1e3),
            },
            "overlap_mm3": {"max": scaled(self._overlap.maximum, 1e9), "mean": scaled(self._overlap.mean, 1e9)},
            "stiffness": {
                "l2": {"mean": self._l2.mean, "max": self._l2.maximum},
                "r2": {"mean": self._r2.mean, "max": self._r2.maximum},
            },
            "min_distance_mm": scaled(self._min_distance_m, 1e3),
            "contacts": sum(self._contacts.values()) if self._knows_truth else None,
            "first_contact": self._first_contact,
            "loop_age_ms": self._loop_age.summary_ms(),
            "task": {
                "time_to_grasp_s": grasp_s,
                "lifted_mm": 1e3 * self._lifted_m,
                "placing": self._placing.summary(self._armed_s) if self._knows_truth else None,
                "obstacle_contacts": self._obstacle_contacts if self._knows_truth else None,
                "contacts_by_object": dict(sorted(self._contacts.items())) if self._knows_truth else None,
                "min_obstacle_distance_mm": scaled(self._min_obstacle_distance_m, 1e3),
            },
        }


class Observer(Protocol):
    """Port of a simulation that tells the truth."""

    @property
    def roles(self) -> Mapping[str, Role]:
        """Roles of the objects, by name"""
        ...

    def observe(self) -> Truth:
        """Return the true distances and contacts."""
        ...

    def contact(self) -> ContactOnset | None:
        """Return a contact that has begun with an object that is no support; called each turn, until the first."""
        ...


def _smaller(one: float | None, other: float | None) -> float | None:
    if one is None or other is None:
        return one if other is None else other
    return min(one, other)
