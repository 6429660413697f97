"""Plain NumPy for what is felt of the looks that were kept, and for how much overlaps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.reaction import HORIZON_S
from feelahead.lab.reference.plain_ways import Primitive
from robot_side.ahead.felt import BEYOND_M
from robot_side.ahead.find import PASSED_OVER
from robot_side.ahead.law import Situation
from robot_side.ahead.looks import L2, R2, STEADY_S, STICK
from robot_side.ahead.tables import STRENGTHS

_SAME_DIRECTION: Final = 0.999


@dataclass(frozen=True)
class Look:
    """One look along a side."""

    side: int
    place: int
    at_s: float
    direction: FloatArray
    began_m: float
    """The tool's place along it"""
    ways_m: FloatArray
    """(2, 8)"""
    reach_m: float
    full_speed_m_s: float
    acceleration_m_s2: float
    sigma_m: float
    overlap_m3: float


class PlainLooks:
    """Keeps the looks that hold: as new as 0.1 s, and of each place along the direction of the newest."""

    def __init__(self) -> None:
        self._kept: list[Look] = []
        self._newest: dict[int, Look] = {}

    def add(self, look: Look) -> None:
        """Take one in."""
        self._kept = [
            one
            for one in self._kept
            if (one.side, one.place) != (look.side, look.place)
            or (look.at_s - one.at_s < STEADY_S and one.direction @ look.direction > _SAME_DIRECTION)
        ]
        self._kept.append(look)
        if look.place == 0:
            self._newest[look.side] = look

    def look_from(self, side: int, places: int) -> None:
        """Forget what was seen from other places."""
        self._kept = [one for one in self._kept if one.side != side or one.place < places]

    def felt(self, situation: Situation, stick_speed_m_s: float, touch_speed_m_s: float) -> dict[str, Any]:
        """Find what is felt of them where the gripper is now: ways (2, 2, 8) of R2 and L2, δ, s(δ), and Sensed's."""
        pose, age_s = situation.pose, situation.loop_age_s
        tool_m, approach = pose.tool_position_m, pose.tool_rotation[:, 2]
        velocity = pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s
        speed = float(velocity @ approach)
        horizons = []
        for side in (R2, L2):
            newest = self._newest[side]
            full, slowing = newest.full_speed_m_s, newest.acceleration_m_s2
            horizons.append(full * (age_s + HORIZON_S) + full**2 / (2.0 * slowing) + BEYOND_M)
            horizons.append(newest.reach_m - (float(newest.direction @ tool_m) - newest.began_m))
        horizon = min(horizons)
        ways = np.array([np.minimum(self._shortest(side, tool_m), horizon) for side in (R2, L2)])
        under_way = np.array([speed, -speed])
        if not situation.loop_age_known:
            under_way = np.maximum(under_way, [self._newest[side].full_speed_m_s for side in (R2, L2)])
        displacement = under_way * age_s
        rumble = 0.0
        if any(one.side == STICK for one in self._kept):
            slowing = self._newest[STICK].acceleration_m_s2
            reach = stick_speed_m_s * (age_s + HORIZON_S) + stick_speed_m_s**2 / (2.0 * slowing)
            zones = self._shortest(STICK, tool_m)[1 if stick_speed_m_s < touch_speed_m_s else 0]
            rumble = float(np.count_nonzero(zones <= reach)) / STRENGTHS
        leading = self._newest[R2 if speed >= 0.0 else L2]
        return {
            "ways, m": ways,
            "δ, m": displacement,
            "stiffness": (ways[:, 0] <= displacement[:, None]).sum(axis=1) / STRENGTHS,
            "speed_m_s": speed,
            "horizon_m": max(horizon, 0.0),
            "rumble": rumble,
            "enlargement_m": float(np.linalg.norm(velocity)) * age_s + leading.sigma_m,
            "overlap_m3": leading.overlap_m3,
        }

    def _shortest(self, side: int, tool_m: FloatArray) -> FloatArray:
        """(2, 8)"""
        moved = [one.ways_m - (one.direction @ tool_m - one.began_m) for one in self._kept if one.side == side]
        shortest: FloatArray = np.min(moved, axis=0, initial=math.inf)
        return shortest


def plain_overlap_m3(spheres: FloatArray, parts: Sequence[Primitive], standing: IntArray) -> float:
    """Σ V_ij of spheres (m, 4) with all primitives but those passed over (eq. 11-12)."""
    volumes = [
        part.overlap(spheres[:, :3], np.ascontiguousarray(spheres[:, 3]))[0].sum()
        for part in parts
        if standing[part.thing] != PASSED_OVER
    ]
    return float(sum(volumes))
