"""The compiled law beside the plain definition, look for look and tick for tick, over recorded ticks."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray, IntArray
from common.touch_speed import touch_speed_m_s
from feelahead.lab.reference.plain_feel import Look, PlainLooks, plain_overlap_m3
from feelahead.lab.reference.plain_ways import plain_ways, primitives, statistical_m
from robot_side.ahead.explanation import moved_and_inflated
from robot_side.ahead.field import Ahead, Along
from robot_side.ahead.law import Situation
from robot_side.ahead.looks import L2, R2, Looks
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.swept_law import SweptLaw
from robot_side.arm.ability import Ability
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings


@dataclass
class Differences:
    """The largest difference of each kind, in SI units, and how much was compared."""

    ticks: int = 0
    looks: int = 0
    ways: int = 0
    """Ways of looks that both know"""
    largest: dict[str, float] = field(default_factory=dict)

    def take(self, name: str, found: npt.ArrayLike, expected: npt.ArrayLike) -> None:
        """Compare; infinite where only one is."""
        found, expected = np.atleast_1d(found), np.atleast_1d(expected)
        same = found == expected
        apart = np.where(same, 0.0, np.abs(np.where(same, 0.0, found) - np.where(same, 0.0, expected)))
        largest = float(apart.max())
        self.largest[name] = max(self.largest.get(name, 0.0), math.inf if math.isnan(largest) else largest)


class _NotedAhead(Ahead):
    """Looks, and notes the question."""

    asked: tuple[GripperPose, SceneTable, IntArray, Along]
    widest_m: float
    situation: Situation
    """The one of this tick"""
    began: Situation
    """The one of the tick in which the look began"""

    def begin(
        self, pose: GripperPose, scene: SceneTable, standing: IntArray, along: Along, widest_m: float = np.inf
    ) -> None:
        """Begin a look."""
        super().begin(pose, scene, standing, along, widest_m)
        self.asked, self.widest_m, self.began = (pose, scene, standing, along), widest_m, self.situation


class _BesideLooks(Looks):
    """Keeps looks, and what is plainly seen in them."""

    def __init__(self, ahead: _NotedAhead, differences: Differences) -> None:
        super().__init__()
        self.plain = PlainLooks()
        self._ahead, self._differences = ahead, differences

    def look_from(self, side: int, places: int) -> None:
        """Forget what was seen from other places."""
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
        sigma_m: float,
        overlap_m3: float,
    ) -> None:
        """Take a look in, and look plainly, too."""
        super().add(side, place, now_s, direction, tool_m, ways_m, able, reach_m, sigma_m, overlap_m3)
        pose, scene, standing, along = self._ahead.asked
        differences, encoder_sigma_rad = self._differences, self._ahead.encoder_sigma_rad
        plain_m = plain_ways(pose, scene.objects, standing, along, self._ahead.widest_m, encoder_sigma_rad)
        sigmas_m, _ = statistical_m(pose, along, encoder_sigma_rad)
        differences.looks += 1
        differences.ways += int(np.isfinite(plain_m).sum())
        differences.take("ways of a look, m", ways_m, plain_m)
        differences.take("largest D_σ of a look, m", sigma_m, sigmas_m.max())
        self.plain.add(
            Look(
                side=side,
                place=place,
                at_s=now_s,
                direction=direction,
                began_m=float(direction @ tool_m),
                ways_m=plain_m,
                reach_m=reach_m,
                full_speed_m_s=able.full_speed_m_s,
                acceleration_m_s2=able.acceleration_m_s2,
                sigma_m=float(sigmas_m.max()),
                overlap_m3=self._overlap_m3(side, place, sigmas_m),
            )
        )

    def _overlap_m3(self, side: int, place: int, sigmas_m: FloatArray) -> float:
        """Sum up what overlaps, moved by the robot side's δ; only along the side that leads."""
        (pose, scene, standing, along), began = self._ahead.asked, self._ahead.began
        velocity = pose.tool_jacobian[:3] @ began.joint_velocities_rad_s
        speed_m_s = float(velocity @ began.pose.tool_rotation[:, 2])
        if place != 0 or side != (R2 if speed_m_s >= 0.0 else L2):
            return 0.0
        moved_m = abs(speed_m_s) * began.loop_age_s * along.direction
        return plain_overlap_m3(moved_and_inflated(pose, moved_m, sigmas_m), primitives(scene.objects), standing)


def compare_ticks(law: SweptLaw, ticks: Iterable[Any], motion: ToolMotionSettings) -> Differences:
    """Work out every tick, `now_s` and `situation`, by both; ValueError for a scene with meshes."""
    differences = Differences()
    ahead = _NotedAhead(law.ahead.encoder_sigma_rad)
    looks = _BesideLooks(ahead, differences)
    law.ahead = law.turns.ahead = ahead
    law.turns.looks = looks
    for tick in ticks:
        situation = ahead.situation = tick.situation
        sensed = law.sense(situation, tick.now_s)
        stick_speed_m_s = motion.stick_speed_m_s * min(math.hypot(*situation.lateral), 1.0)
        plain = looks.plain.felt(situation, stick_speed_m_s, touch_speed_m_s(motion.trigger_speed_m_s))
        both = sensed.r2, sensed.l2
        differences.ticks += 1
        differences.take("ways, m", [(side.fast_m, side.slow_m) for side in both], plain["ways, m"])
        differences.take("δ, m", [side.displacement_m for side in both], plain["δ, m"])
        differences.take("stiffness", [side.stiffness for side in both], plain["stiffness"])
        for name in ("speed_m_s", "horizon_m", "rumble", "enlargement_m"):
            differences.take(name, getattr(sensed, name), plain[name])
        whole_m3 = float(4.0 / 3.0 * np.pi * (situation.pose.sphere_radii_m**3).sum())
        differences.take("overlap, of the spheres", sensed.overlap_m3 / whole_m3, plain["overlap_m3"] / whole_m3)
    return differences
