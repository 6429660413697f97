"""The compiled law beside a plain formulation, look for look and tick for tick, over recorded ticks."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray, IntArray
from common.protocol.messages import TriggerField
from common.touch_speed import touch_speed_m_s
from feelahead.benchmarks.felt.plain_feel import Look, PlainLooks, plain_overlap_m3
from feelahead.benchmarks.felt.plain_ways import plain_ways, primitives, statistical_m
from feelahead.benchmarks.felt.recorded_ticks import Recorded, Tick
from robot_side.ahead.explanation import moved_and_inflated
from robot_side.ahead.field import ALL, Ahead, Along, Field
from robot_side.ahead.law import Sensed, Situation
from robot_side.ahead.looks import L2, R2, Looks
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.swept_law import SweptLaw
from robot_side.ahead.turns import Prospect
from robot_side.arm.ability import Ability
from robot_side.arm.port import GripperPose


@dataclass
class Differences:
    """The largest of each kind, in SI units, and how much was compared."""

    ticks: int = 0
    looks: int = 0
    ways: int = 0
    """Of looks, that are known by both"""
    largest: dict[str, float] = field(default_factory=dict)

    def take(self, name: str, found: npt.ArrayLike, expected: npt.ArrayLike) -> None:
        """Compare; infinite where only one is."""
        found, expected = np.atleast_1d(found), np.atleast_1d(expected)
        same = found == expected
        apart = np.where(same, 0.0, np.abs(np.where(same, 0.0, found) - np.where(same, 0.0, expected)))
        largest = float(apart.max())
        self.largest[name] = max(self.largest.get(name, 0.0), math.inf if math.isnan(largest) else largest)


class _BesideAhead(Ahead):
    """Looks, and looks plainly, too."""

    differences: Differences
    plain_m: FloatArray
    asked: tuple[GripperPose, SceneTable, IntArray, Along]
    widest_m: float

    def begin(
        self, pose: GripperPose, scene: SceneTable, standing: IntArray, along: Along, widest_m: float = np.inf
    ) -> None:
        """As any."""
        super().begin(pose, scene, standing, along, widest_m)
        self.asked, self.widest_m = (pose, scene, standing, along), widest_m

    def go_on(self, most: int = ALL) -> Field | None:
        """As any."""
        found = super().go_on(most)
        if found is None:
            return None
        pose, scene, standing, along = self.asked
        plain_m = plain_ways(pose, scene.objects, standing, along, self.widest_m, self.encoder_sigma_rad)
        self.differences.looks += 1
        self.differences.ways += int(np.isfinite(plain_m).sum())
        self.differences.take("ways of a look, m", found.ways_m, plain_m)
        sigma_m = statistical_m(pose, along, self.encoder_sigma_rad)[0].max()
        self.differences.take("largest D_σ of a look, m", found.sigma_m, sigma_m)
        self.plain_m = plain_m
        return found


class _BesideLooks(Looks):
    """Keeps looks, and what was plainly seen in them."""

    def __init__(self, ahead: _BesideAhead, overlap_m3: Callable[[int, int], float]) -> None:
        super().__init__()
        self.plain = PlainLooks()
        self._ahead, self._overlap_m3 = ahead, overlap_m3

    def look_from(self, side: int, places: int) -> None:
        """As any."""
        super().look_from(side, places)
        self.plain.look_from(side, places)

    def add(
        self,
        side: int,
        place: int,
        now_s: float,
        direction: FloatArray,
        tool_m: FloatArray,
        ways_m: FloatArray,
        able: Ability,
        reach_m: float,
        *others: Any,
    ) -> None:
        """As any."""
        super().add(side, place, now_s, direction, tool_m, ways_m, able, reach_m, *others)
        pose, _, _, along = self._ahead.asked
        self.plain.add(
            Look(
                side=side,
                place=place,
                at_s=now_s,
                direction=direction,
                began_m=float(direction @ tool_m),
                ways_m=self._ahead.plain_m,
                reach_m=reach_m,
                full_speed_m_s=able.full_speed_m_s,
                acceleration_m_s2=able.acceleration_m_s2,
                sigma_m=float(statistical_m(pose, along, self._ahead.encoder_sigma_rad)[0].max()),
                overlap_m3=self._overlap_m3(side, place),
            )
        )


class BesideLaw(SweptLaw):
    """The law, whose every tick is worked out plainly, too."""

    _began: Situation

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.differences = Differences()
        self._beside = _BesideAhead(self.ahead.encoder_sigma_rad)
        self._beside.differences = self.differences
        self.ahead = self.turns.ahead = self._beside
        self._kept = _BesideLooks(self._beside, self._plain_overlap_m3)
        self.turns.looks = self._kept

    def _prospect(self, side: int, situation: Situation, pose: GripperPose) -> Prospect:
        self._began = situation
        return super()._prospect(side, situation, pose)

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick."""
        sensed = super().sense(situation, now_s)
        stick_speed_m_s = self._motion.stick_speed_m_s * min(math.hypot(*situation.lateral), 1.0)
        plain = self._kept.plain.felt(situation, stick_speed_m_s, touch_speed_m_s(self._motion.trigger_speed_m_s))
        both = sensed.r2, sensed.l2
        differences = self.differences
        differences.ticks += 1
        differences.take("ways, m", [_ways(side) for side in both], plain.ways_m)
        differences.take("δ, m", [side.displacement_m for side in both], plain.displacement_m)
        differences.take("stiffness", [side.stiffness for side in both], plain.stiffness)
        differences.take("speed, m/s", sensed.speed_m_s, plain.speed_m_s)
        differences.take("horizon, m", sensed.horizon_m, plain.horizon_m)
        differences.take("rumble", sensed.rumble, plain.rumble)
        differences.take("enlargement, m", sensed.enlargement_m, plain.enlargement_m)
        share = 1.0 / float(4.0 / 3.0 * np.pi * (situation.pose.sphere_radii_m**3).sum())
        differences.take("overlap, of the spheres' volume", share * sensed.overlap_m3, share * plain.overlap_m3)
        return sensed

    def _plain_overlap_m3(self, side: int, place: int) -> float:
        """Of the gripper in the last look, moved by the robot side's δ; only along the side that leads."""
        pose, scene, standing, along = self._beside.asked
        velocity = pose.tool_jacobian[:3] @ self._began.joint_velocities_rad_s
        speed_m_s = float(velocity @ self._began.pose.tool_rotation[:, 2])
        if place != 0 or side != (R2 if speed_m_s >= 0.0 else L2):
            return 0.0
        moved_m = abs(speed_m_s) * self._began.loop_age_s * along.direction
        sigma_m, _ = statistical_m(pose, along, self._beside.encoder_sigma_rad)
        return plain_overlap_m3(moved_and_inflated(pose, moved_m, sigma_m), primitives(scene.objects), standing)


def _ways(felt: TriggerField) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return felt.fast_m, felt.slow_m


def compare(recorded: Recorded, advance: Callable[[Tick], None] = lambda _: None) -> Differences:
    """Every recorded tick by both; ValueError for a scene with meshes."""
    law = BesideLaw(*recorded.law)
    for tick in recorded.ticks:
        law.sense(tick.situation, tick.now_s)
        advance(tick)
    return law.differences
