"""Port of an arm, simulated or real: commands, measured states and forward kinematics."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Protocol

import numpy as np

from common.arrays import BoolArray, FloatArray
from common.clock import Clock

CLUSTER: Final = 6
"""Number of consecutive spheres of a gripper that share one bounding sphere, so they should be near each other"""


@dataclass
class ArmState:
    """State of the arm as its sensors measure it, never the truth. The arrays are contiguous."""

    time_s: float
    """Time of the measurement, on the same clock as the `now_s` of `Arm.state`."""
    joint_positions_rad: FloatArray
    """(n,) encoder readings, with their noise and quantisation; metres for a prismatic joint."""
    joint_velocities_rad_s: FloatArray
    """(n,) velocities as the drives estimate them."""
    finger_positions: FloatArray
    """(f,) readings of the gripper's joints, in the model's order; empty without a gripper."""
    gripper_opening_m: float
    """Free gap between the fingers, in m; 0 without a gripper."""
    gripper_holding: bool
    """Whether an object between the fingers stopped them while they were commanded to close."""
    joint_loads_nm: FloatArray | None = None
    """(n,) torques of the drives beyond those that move and hold the arm itself: from the weight of what the arm
    carries, less what supports it. N for a prismatic joint. None from an arm that does not measure them."""
    simulated_s: float | None = None
    """Simulated time, which slow physics lets fall behind `time_s`; None if nothing is simulated"""
    doubt: str | None = None
    """Why the arm must not move by this state, in words; None if nothing speaks against it"""
    condition: str | None = None
    """Why the arm's own controller lets nothing move, in words: a protective stop, say; None if it is ready"""


class Arm(Protocol):
    """Velocity-controlled arm that stops by itself if no new command comes.

    The last three methods concern the pace of a simulation; a derived class without them runs in real time.
    """

    @property
    def joint_count(self) -> int:
        """Number n of joints between the base and the tool."""
        ...

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Follow `joint_velocity_rad_s` (n,) until `valid_until_s`, then decelerate from the measured state.

        ValueError for a wrong shape or a value that is not finite; nothing of such a command is applied.
        """
        ...

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Move the fingers until `valid_until_s`; closing: share of full speed, +1 closes, 0 holds, -1 opens."""
        ...

    def state(self, now_s: float) -> ArmState:
        """Return the measured state at `now_s`; a simulated arm first advances its physics to `now_s`."""
        ...

    def give_way(self, clock: Clock) -> None:
        """Fall behind real time (read from `clock`) from now on, rather than block the caller of `state`."""
        del clock

    @property
    def share_of_real_time(self) -> float:
        """Simulated time since the first `state`, divided by real time: 0 to 1."""
        return 1.0

    def take_share_of_real_time(self) -> float:
        """Return the simulated time since the last call, divided by real time."""
        return 1.0


@dataclass
class GripperPose:
    """Tool and spheres of the gripper by forward kinematics, in the world frame (eq. 4).

    The arrays are contiguous and never change, so a stiffness field may keep the pose from which it was computed.
    """

    tool_position_m: FloatArray
    """(3,) origin of the tool's frame"""
    tool_rotation: FloatArray
    """(3, 3) tool to world; the approach axis is the last column."""
    tool_jacobian: FloatArray
    """(6, n) Jacobian of the tool in the world frame: three linear rows, then three angular ones"""
    sphere_centers_m: FloatArray
    """(m, 3) centres of the gripper's spheres"""
    sphere_radii_m: FloatArray
    """(m,) radii before the enlargement"""
    sphere_on_finger: BoolArray
    """(m,) whether the sphere belongs to a finger."""

    @cached_property
    def sphere_jacobians(self) -> FloatArray:
        """(m, 3, n) positional Jacobian of each centre, as if all moved with the tool: v + ω × r for each joint."""
        lever = self.sphere_centers_m - self.tool_position_m
        turned = np.cross(self.tool_jacobian[3:].T, lever[:, None])
        jacobians: FloatArray = self.tool_jacobian[:3] + turned.swapaxes(1, 2)
        return jacobians


class GripperKinematics(Protocol):
    """Forward kinematics of the estimated configuration: from encoder readings, never from the simulation's truth."""

    @property
    def has_fingers(self) -> bool:
        """Whether any of the gripper's spheres is on a finger."""
        ...

    def pose(self, state: ArmState) -> GripperPose:
        """Return the gripper's pose for the measured `state`."""
        ...

    def link_spheres(self, state: ArmState) -> tuple[FloatArray, FloatArray]:
        """Return centres (k, 3) and radii (k,) of coarse spheres around the links for the measured `state`."""
        ...
