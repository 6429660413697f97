"""What moves the gripper besides a trigger: drift across, turning, and the fingers' own way. Where will it be by then?

What lies ahead of where the gripper is may not lie ahead of where it will be: the field is looked at from there, too.
"""

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose

SPACING_M: Final = 0.015
"""No sphere gets farther between two places that are looked from, less than an inflated fingertip's sphere is wide. Of
who gets beyond the most places times this, places are farther apart."""
_LEAST_M: Final = 0.003
"""Who gets no farther than this is looked at where it is."""
MOST_PLACES: Final = 8
_NOISE_M_S: Final = 0.015
"""Slower than this, fingers rest: their readings are noisy."""
_FINGERS_S: Final = 0.06
"""Over so long their speed is measured."""


@dataclass(frozen=True)
class Sideways:
    """The gripper's velocity without that along the tool's approach axis, in the world frame."""

    linear_m_s: FloatArray
    """(3,) of the tool"""
    angular_rad_s: FloatArray
    """(3,)"""
    own_m_s: FloatArray
    """(m, 3) of each sphere against the tool: the fingers'"""

    @property
    def moves_fingers(self) -> bool:
        """Whether the fingers move against the tool."""
        return bool(self.own_m_s.any())

    def farthest_m(self, pose: GripperPose, after_s: float, ahead_m: float) -> float:
        """How far the sphere that gets farthest has gone by then, or one that is `ahead_m` farther on."""
        lever = pose.sphere_centers_m - pose.tool_position_m
        farther = lever + ahead_m * pose.tool_rotation[:, 2]
        speeds = [self.linear_m_s + np.cross(self.angular_rad_s, one) + self.own_m_s for one in (lever, farther)]
        return after_s * float(np.linalg.norm(speeds, axis=2).max(initial=0.0))

    def moments(self, pose: GripperPose, until_s: float, ahead_m: float = 0.0) -> tuple[float, ...]:
        """When to look from where the gripper will be, evenly in time, the last at `until_s`; none where it stays.

        ahead_m: so far ahead it is to be looked as finely as near the gripper, which counts while it turns.
        None for what is not finite, either: whoever looks refuses that.
        """
        farthest_m = self.farthest_m(pose, until_s, ahead_m)
        moves = farthest_m >= _LEAST_M and math.isfinite(farthest_m)
        count = min(math.ceil(farthest_m / SPACING_M), MOST_PLACES) if moves else 0
        return tuple(until_s * (number + 1) / count for number in range(count))

    def moved(self, pose: GripperPose, after_s: float) -> GripperPose:
        """The gripper as it will stand then, had the trigger not moved it."""
        turn = Rotation.from_rotvec(self.angular_rad_s * after_s).as_matrix()
        tool_m = pose.tool_position_m + self.linear_m_s * after_s
        lever = pose.sphere_centers_m + self.own_m_s * after_s - pose.tool_position_m
        return replace(
            pose,
            tool_position_m=tool_m,
            tool_rotation=turn @ pose.tool_rotation,
            sphere_centers_m=tool_m + lever @ turn.T,
        )


class FingerMotion:
    """How the spheres move against the tool, by where they were."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, FloatArray]] = deque()

    def see(self, pose: GripperPose, now_s: float) -> FloatArray:
        """Take in a pose; velocities (m, 3) in m/s against the tool, world frame; 0 where there were other spheres."""
        in_tool = (pose.sphere_centers_m - pose.tool_position_m) @ pose.tool_rotation
        if self._seen and self._seen[-1][1].shape != in_tool.shape:
            self._seen.clear()
        self._seen.append((now_s, in_tool))
        while self._seen[0][0] < now_s - _FINGERS_S - 1e-9:
            self._seen.popleft()
        then_s, then = self._seen[0]
        if now_s <= then_s:
            return np.zeros_like(in_tool)
        velocities: FloatArray = (in_tool - then) / (now_s - then_s) @ pose.tool_rotation.T
        return velocities if np.abs(velocities).max(initial=0.0) > _NOISE_M_S else np.zeros_like(velocities)
