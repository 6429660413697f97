"""Where the true tool was in a recorded approach, how fast, and what its arm could do there."""

from collections.abc import Callable
from typing import Final

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from feelahead.lab.approaches.recording import RecordedApproach
from robot_side.arm.ability import along_approach
from robot_side.arm.port import GripperPose
from robot_side.simulation.joint_reference import MotionLimits

_LEAST_SPEED: Final = 1e-9
PoseAt = Callable[[FloatArray], GripperPose]
"""The gripper with its joints (n,) there."""


class ToolPath:
    """The tool's point over time, between the recorded poses, in the world frame."""

    def __init__(self, record: RecordedApproach, pose_at: PoseAt, limits: MotionLimits, full_speed_m_s: float) -> None:
        """Follow `record` by the true joints; `limits` and v_max say what is within reach."""
        poses = [pose_at(joints) for joints in record.joint_positions_rad]
        able = [along_approach(pose, limits.of_joints(pose.tool_jacobian.shape[1]), full_speed_m_s) for pose in poses]
        self.time_s = record.pose_time_s
        self._positions_m = np.array([pose.tool_position_m for pose in poses])
        self._axes = np.array([pose.tool_rotation[:, 2] for pose in poses])
        self._velocities_m_s = np.array(
            [pose.tool_jacobian[:3] @ rates for pose, rates in zip(poses, record.joint_velocities_rad_s, strict=True)]
        )
        self._speeds_m_s: FloatArray = np.einsum("ki,ki->k", self._velocities_m_s, self._axes)
        self._full_speeds_m_s = np.array([one.full_speed_m_s for one in able])
        self._acceleration_m_s2 = np.array([one.acceleration_m_s2 for one in able])
        self._within_reach: BoolArray = np.array([one.within_reach for one in able])

    def speeds_m_s(self, times_s: FloatArray) -> FloatArray:
        """(k,) along the approach axis."""
        speeds: FloatArray = np.interp(times_s, self.time_s, self._speeds_m_s)
        return speeds

    def full_speeds_m_s(self, times_s: FloatArray) -> FloatArray:
        """(k,) v_max as the arm gives it in its pose at these times."""
        speeds: FloatArray = np.interp(times_s, self.time_s, self._full_speeds_m_s)
        return speeds

    def accelerations_m_s2(self, times_s: FloatArray) -> FloatArray:
        """(k,) a, the least that the joints give along the approach axis."""
        accelerations: FloatArray = np.interp(times_s, self.time_s, self._acceleration_m_s2)
        return accelerations

    def within_reach(self, from_s: FloatArray, to_s: FloatArray) -> BoolArray:
        """(k,) whether full speed was within the arm's reach throughout each of these times."""
        outside = np.concatenate([[0], np.cumsum(~self._within_reach)])
        first = np.maximum(np.searchsorted(self.time_s, from_s, side="right") - 1, 0)
        behind = np.minimum(np.searchsorted(self.time_s, to_s, side="left") + 1, len(self.time_s))
        clear: BoolArray = outside[behind] == outside[first]
        return clear

    def ways_m(self, from_s: FloatArray, to_s: FloatArray) -> FloatArray:
        """(k,) how far the tool came along the axis that it had at the beginning."""
        row, part = self._place(from_s)
        axes = (1.0 - part) * self._axes[row] + part * self._axes[row + 1]
        axes /= np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), _LEAST_SPEED)
        moved = self._positions_at(to_s) - self._positions_at(from_s)
        ways: FloatArray = np.einsum("ki,ki->k", moved, axes)
        return ways

    def _place(self, times_s: FloatArray) -> tuple[IntArray, FloatArray]:
        """The row before each time, and (k, 1) how far on it is to the next one."""
        row: IntArray = np.searchsorted(self.time_s, times_s, side="right").astype(np.int64) - 1
        row = np.clip(row, 0, len(self.time_s) - 2)
        return row, ((times_s - self.time_s[row]) / (self.time_s[row + 1] - self.time_s[row]))[:, None]

    def _positions_at(self, times_s: FloatArray) -> FloatArray:
        """(k, 3) by cubics that have the recorded positions and velocities."""
        row, u = self._place(times_s)
        step_s = (self.time_s[row + 1] - self.time_s[row])[:, None]
        here, there = self._positions_m[row], self._positions_m[row + 1]
        leaving, arriving = step_s * self._velocities_m_s[row], step_s * self._velocities_m_s[row + 1]
        cubic: FloatArray = (
            (1.0 + 2.0 * u) * (1.0 - u) ** 2 * here
            + u * (1.0 - u) ** 2 * leaving
            + u * u * (3.0 - 2.0 * u) * there
            + u * u * (u - 1.0) * arriving
        )
        return cubic
