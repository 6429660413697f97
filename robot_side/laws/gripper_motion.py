"""Motion of the gripper, measured: the tool's velocities, and the fingers' motion from recent positions."""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose

_NOISE_M_S: Final = 0.015
"""Speed up to which the fingers count as at rest, because their position readings are noisy"""
_FINGERS_S: Final = 0.06
"""Time over which the fingers' speed is measured"""
_PERIOD_S: Final = 0.008
"""Period of this measurement: looks are made no more often"""
STILL_M_S: Final = 0.002
_STILL_RAD_S: Final = 0.01
"""Speed and angular speed up to which the gripper counts as at rest; objects count so up to STILL_M_S"""


class GripperMotion(NamedTuple):
    """Velocities of the gripper, in the world frame."""

    linear_m_s: FloatArray
    """(3,) velocity of the tool's point"""
    turning_rad_s: FloatArray
    """(3,) angular velocity of the tool"""
    ahead_m_s: float
    """Speed of the tool's point along the approach axis"""
    speed_m_s: float
    """Speed of the tool's point in any direction"""
    fingers_m_s: FloatArray | None
    """(m, 3) velocity of each sphere relative to the tool; None while the fingers rest"""
    moves: bool
    """Whether the gripper or its fingers move"""


@dataclass
class FingerSpeeds:
    """Positions of all spheres in the tool's frame, of the last 0.06 s."""

    _measured: deque[tuple[float, FloatArray]] = field(default_factory=deque)
    _speeds_m_s: FloatArray | None = None

    def measure(self, pose: GripperPose, now_s: float) -> FloatArray | None:
        """Return the velocity (m, 3) of each sphere relative to the tool; None while the fingers rest.

        It is measured every 8 ms. Spheres in another number are at rest at first.
        """
        measured = self._measured
        if measured and (len(measured[-1][1]) != len(pose.sphere_centers_m) or now_s < measured[-1][0]):
            measured.clear()
        if measured and now_s - measured[-1][0] + 1e-9 < _PERIOD_S:
            return self._speeds_m_s
        self._speeds_m_s = self._measured_now(pose, now_s)
        return self._speeds_m_s

    def _measured_now(self, pose: GripperPose, now_s: float) -> FloatArray | None:
        measured = self._measured
        while measured and measured[0][0] < now_s - _FINGERS_S - 1e-9:
            measured.popleft()
        at_m = (pose.sphere_centers_m - pose.tool_position_m) @ pose.tool_rotation
        measured.append((now_s, at_m))
        passed_s = now_s - measured[0][0]
        if passed_s <= 0.0:
            return None
        speeds_m_s: FloatArray = ((at_m - measured[0][1]) / passed_s) @ pose.tool_rotation.T
        return speeds_m_s if np.abs(speeds_m_s).max(initial=0.0) > _NOISE_M_S else None


def gripper_motion(
    pose: GripperPose, joint_velocities_rad_s: FloatArray, fingers_m_s: FloatArray | None
) -> GripperMotion:
    """Return the gripper's motion at these rates of the joints (n,)."""
    twist = pose.tool_jacobian @ joint_velocities_rad_s
    linear_m_s, turning_rad_s = twist[:3], twist[3:]
    speed_m_s, rate_rad_s = math.sqrt(linear_m_s @ linear_m_s), math.sqrt(turning_rad_s @ turning_rad_s)
    moves = speed_m_s > STILL_M_S or rate_rad_s > _STILL_RAD_S or fingers_m_s is not None
    ahead_m_s = float(pose.tool_rotation[:, 2] @ linear_m_s)
    return GripperMotion(linear_m_s, turning_rad_s, ahead_m_s, speed_m_s, fingers_m_s, moves)
