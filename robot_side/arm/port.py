"""The Arm port: what feelahead asks of a robot, simulated or real, and what it gets back."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from common.arrays import BoolArray, FloatArray
from common.clock import Clock


@dataclass
class ArmState:
    """What the arm measures of itself: never the truth, always what its sensors say. Its arrays are contiguous."""

    time_s: float
    """When it was measured, on the clock of the `now` that `state` was given."""
    joint_positions_rad: FloatArray
    """(n,) encoder readings, with their noise and quantisation; metres for a prismatic joint."""
    joint_velocities_rad_s: FloatArray
    """(n,) the drives' own velocity estimate."""
    finger_positions: FloatArray
    """(f,) readings of the gripper's joints, in the model's order; empty without a gripper."""
    gripper_opening_m: float
    """The free gap between the fingers; 0 without a gripper."""
    gripper_holding: bool
    """The fingers were told to close and something between them stopped them."""
    joint_loads_nm: FloatArray | None = None
    """(n,) what the drives give beyond what moves and holds the arm itself: what it carries, less what bears it; N for
    a prismatic joint. None from an arm that does not know."""


class Arm(Protocol):
    """A velocity-controlled arm that stops by itself when it is no longer told to go on.

    The last three say how a simulation keeps up; an arm that derives from this class runs in real time.
    """

    @property
    def joint_count(self) -> int:
        """The number n of joints between the base and the tool."""
        ...

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Follow `joint_velocity_rad_s` (n,) until `valid_until_s`, then decelerate from the measured state.

        ValueError for a wrong shape or a value that is not finite: nothing of it is applied.
        """
        ...

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Close (+1), hold (0) or open (-1) at that fraction of the gripper's speed until `valid_until_s`."""
        ...

    def state(self, now_s: float) -> ArmState:
        """The measured state at `now_s`; a simulated arm advances its physics up to then first."""
        ...

    def give_way(self, clock: Clock) -> None:
        """From now on fall behind real time, by `clock`, rather than hold up the caller of `state`."""
        del clock

    @property
    def share_of_real_time(self) -> float:
        """Simulated time over real time since the first `state`, 0 to 1."""
        return 1.0

    def take_share_of_real_time(self) -> float:
        """Return the same since the last call."""
        return 1.0


@dataclass
class GripperPose:
    """Where forward kinematics puts the tool and the gripper's spheres, in the world frame (eq. 4).

    Its arrays are contiguous, and stay as they are: a pose is kept for as long as a field that was looked at from it.
    """

    tool_position_m: FloatArray
    """(3,)"""
    tool_rotation: FloatArray
    """(3, 3) tool to world; the approach axis is one of its columns."""
    tool_jacobian: FloatArray
    """(6, n) linear rows first, world frame."""
    sphere_centers_m: FloatArray
    """(m, 3)"""
    sphere_radii_m: FloatArray
    """(m,) not enlarged"""
    sphere_on_finger: BoolArray
    """(m,) whether the sphere belongs to a finger."""

    @cached_property
    def sphere_jacobians(self) -> FloatArray:
        """(m, 3, n) positional Jacobian of each centre, as it moves with the tool: v + ω × r for each joint."""
        lever = self.sphere_centers_m - self.tool_position_m
        turned = np.cross(self.tool_jacobian[3:].T, lever[:, None])
        jacobians: FloatArray = self.tool_jacobian[:3] + turned.swapaxes(1, 2)
        return jacobians


class GripperKinematics(Protocol):
    """Forward kinematics of the estimated configuration: it sees encoder readings, not the simulation."""

    @property
    def has_fingers(self) -> bool:
        """Whether any sphere is on a finger."""
        ...

    def pose(self, state: ArmState) -> GripperPose:
        """The gripper at `state`."""
        ...
