"""Standard deviation of a point of the gripper that follows from the encoders' errors, by eq. 5 and by other methods.

As the truth counts a Monte Carlo simulation of the exact kinematics, given with its own standard error.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.clock import MonotonicClock
from feelahead.lab.table import Row
from feelahead.lab.turns import in_turns, least_ns
from robot_side.arm.port import ArmState, GripperPose
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.scene import Scene
from robot_side.enlargement.kinematic_error import directional_variance, position_covariance

NOISE_RAD: Final = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""Tried standard deviations of the joints' errors, in rad; all joints have the same."""
BATCHES: Final = 20
"""Number of batches into which the draws are split; the spread between batches gives the standard error."""
METHODS: Final = ("linear", "once", "unscented")
SINGULAR: Final = "singular"
_SAMPLED: Final = 256
"""Number of sampled configurations over which the paper's method `once` takes the largest error."""
_ENCODER_RAD: Final = 2e-4

Displacements = Callable[[FloatArray], FloatArray]
"""Function from joint errors (k, n) to a point's displacements (k, 3)."""


class Chain:
    """Kinematics of one point that n joints carry, near one configuration: product of exponentials (Brockett 1984).

    x = exp(ξ₁ δ₁) ... exp(ξₙ δₙ) p, where ξ are the joints' screws at that configuration, from base to tip. Joint i
    turns all links beyond it about its axis by δᵢ. The screws are the columns of the geometric Jacobian, so no other
    model of the robot is needed.
    """

    def __init__(self, jacobian: FloatArray, tool_position_m: FloatArray, point_m: FloatArray) -> None:
        """jacobian (6, n): of the tool's point, linear rows first, joints from base to tip.

        point_m (3,): point to follow, anywhere on the last joint's link. Everything is in the world frame.
        """
        self._point_m = point_m
        self._axes = np.ascontiguousarray(jacobian[3:].T)
        self._linear = np.ascontiguousarray(jacobian[:3].T)
        # ω × (p - c) = v with c on the axis: c = p - v × ω, as |ω| = 1.
        self._on_axes_m = tool_position_m - np.cross(self._linear, self._axes)

    def displacements(self, changes_rad: FloatArray) -> FloatArray:
        """Return the point's displacements (k, 3) in metres for joint changes (k, n).

        Displacements are summed, not positions, so that changes of 1e-5 rad lose no digits.
        """
        moved = np.zeros((len(changes_rad), 3))
        for joint in reversed(range(len(self._axes))):
            axis, change = self._axes[joint], changes_rad[:, joint, None]
            if not axis.any():
                moved += change * self._linear[joint]
                continue
            across = np.cross(axis, moved + (self._point_m - self._on_axes_m[joint]))
            moved += np.sin(change) * across + 2.0 * np.sin(0.5 * change) ** 2 * np.cross(axis, across)
        return moved


class PosedGripper:
    """Gripper of a scene, placed by eq. 4 in any configuration; the fingers stay as at the scene's start."""

    def __init__(self, scene: Scene) -> None:
        robot = scene.robot
        self.home_rad: FloatArray = scene.data.qpos[robot.arm_positions].copy()
        self.fingers: FloatArray = scene.data.qpos[robot.finger_positions].copy()
        # A joint without limits is drawn over one turn.
        self._lower_rad = np.where(np.isfinite(robot.lower_rad), robot.lower_rad, -np.pi)
        self._upper_rad = np.where(np.isfinite(robot.upper_rad), robot.upper_rad, np.pi)
        self._kinematics = MujocoKinematics(scene)

    def at(self, joint_positions_rad: FloatArray) -> GripperPose:
        """Return the gripper's pose for the joint positions (n,)."""
        still = np.zeros_like(joint_positions_rad)
        return self._kinematics.pose(ArmState(0.0, joint_positions_rad, still, self.fingers, 0.0, False))

    def drawn(self, count: int, *seed: int) -> FloatArray:
        """Draw joint positions (count, n), uniform over the joints' ranges."""
        shape = count, len(self.home_rad)
        return np.random.default_rng(seed).uniform(self._lower_rad, self._upper_rad, shape)


def linear_sd_m(jacobian: FloatArray, noise_rad: float, axis: FloatArray) -> float:
    """Return the standard deviation along `axis` by eq. 5: √(ûᵀ J diag(σ²) Jᵀ û). jacobian (3, n): of the point."""
    covariances = position_covariance(jacobian[None], np.full(jacobian.shape[1], noise_rad))
    return float(np.sqrt(directional_variance(covariances, axis[None])[0]))


def unscented_sd_m(displacements: Displacements, joints: int, noise_rad: float, axis: FloatArray) -> float:
    """Return the standard deviation along `axis` by the unscented transform (Julier, Uhlmann 1997), κ = 3 - n.

    Its 2n + 1 points are no error, and an error of ±√3 σ in each joint alone.
    """
    step = np.sqrt(3.0) * noise_rad * np.eye(joints)
    along = displacements(np.concatenate([np.zeros((1, joints)), step, -step])) @ axis
    weights = np.concatenate([[1.0 - joints / 3.0], np.full(2 * joints, 1.0 / 6.0)])
    # The first weight is negative from n = 4 on, so the variance may become negative.
    return float(np.sqrt(max(float(weights @ (along - weights @ along) ** 2), 0.0)))


def monte_carlo_sd_m(displacements: Displacements, errors_rad: FloatArray, axis: FloatArray) -> tuple[float, float]:
    """Return the true standard deviation along `axis` for drawn joint errors (k, n), and its standard error.

    k must be a multiple of BATCHES.
    """
    along = np.concatenate([displacements(batch) for batch in np.split(errors_rad, BATCHES)]) @ axis
    spread = along.reshape(BATCHES, -1).std(axis=1).std(ddof=1)
    return float(along.std()), float(spread / np.sqrt(BATCHES))


def places(gripper: PosedGripper, count: int, seed: int) -> dict[str, FloatArray]:
    """Return joint positions (n,) by name: home, `count` random ones within the joints' ranges, and a singular one.

    The singular one is the sample with the smallest ratio of the error along the approach to the largest error in any
    direction.
    """

    def share_along(configuration: FloatArray) -> float:
        pose = gripper.at(configuration)
        jacobian = pose.tool_jacobian[:3]
        return linear_sd_m(jacobian, 1.0, pose.tool_rotation[:, 2]) / float(np.linalg.norm(jacobian, 2))

    found = {"home": gripper.home_rad}
    found |= {f"random {number}": row for number, row in enumerate(gripper.drawn(count, seed, 1), 1)}
    return found | {SINGULAR: min(gripper.drawn(_SAMPLED, seed, 2), key=share_along)}


def once_sd_m(gripper: PosedGripper, seed: int) -> float:
    """Return the factor of the paper's method `once`, in m/rad: the largest singular value of all spheres' Jacobians.

    It is taken over all sampled configurations.
    """
    jacobians = (gripper.at(configuration).sphere_jacobians for configuration in gripper.drawn(_SAMPLED, seed, 2))
    return max(float(np.linalg.norm(of_spheres, 2, axis=(1, 2)).max()) for of_spheres in jacobians)


def measure(gripper: PosedGripper, number: int, configurations: int, draws: int, seed: int) -> Iterator[Row]:
    """Yield a row for each point and joint noise in configuration `number`. draws: a multiple of BATCHES.

    The two points are the tool's, and the centre of the gripper's sphere that is farthest from the tool's point.
    """
    once_m = once_sd_m(gripper, seed)
    place, configuration = list(places(gripper, configurations, seed).items())[number]
    pose = gripper.at(configuration)
    axis, joints = pose.tool_rotation[:, 2], len(configuration)
    standard = np.random.default_rng([seed, 3, number]).standard_normal((draws, joints))
    farthest = int(np.argmax(np.linalg.norm(pose.sphere_centers_m - pose.tool_position_m, axis=1)))
    for point, position, jacobian in (
        ("tool", pose.tool_position_m, pose.tool_jacobian[:3]),
        ("far sphere", pose.sphere_centers_m[farthest], pose.sphere_jacobians[farthest]),
    ):
        chain = Chain(pose.tool_jacobian, pose.tool_position_m, position)
        for noise_rad in NOISE_RAD:
            sd_m, error_m = monte_carlo_sd_m(chain.displacements, noise_rad * standard, axis)
            found_m = {
                "linear": linear_sd_m(jacobian, noise_rad, axis),
                "once": once_m * noise_rad,
                "unscented": unscented_sd_m(chain.displacements, joints, noise_rad, axis),
            }
            row = {"place": place, "point": point, "noise_rad": noise_rad, "sd_mm": 1e3 * sd_m}
            row |= {f"{method}_sd_error_percent": 100.0 * (own_m / sd_m - 1.0) for method, own_m in found_m.items()}
            yield row | {"sd_uncertainty_percent": 100.0 * error_m / sd_m}


def run_times_us(gripper: PosedGripper, turns: int) -> dict[str, float]:
    """Return the run time of one call of each method in the home configuration, for one point and one direction.

    The least time of all turns counts. "linear" uses a Jacobian that is given, as in a tick. "unscented" computes its
    2n + 1 poses one by one.
    """
    pose = gripper.at(gripper.home_rad)
    axis, joints = pose.tool_rotation[:, 2], len(gripper.home_rad)
    jacobians, axes, noise = pose.tool_jacobian[None, :3], axis[None], np.full(joints, _ENCODER_RAD)

    def by_poses(changes_rad: FloatArray) -> FloatArray:
        return np.array([gripper.at(gripper.home_rad + change).tool_position_m for change in changes_rad])

    def with_kinematics() -> object:
        here = gripper.at(gripper.home_rad)
        return linear_sd_m(here.tool_jacobian[:3], _ENCODER_RAD, here.tool_rotation[:, 2])

    calls: dict[str, Callable[[], object]] = {
        "linear": lambda: directional_variance(position_covariance(jacobians, noise), axes),
        "linear, with kinematics": with_kinematics,
        "unscented": lambda: unscented_sd_m(by_poses, joints, _ENCODER_RAD, axis),
    }
    clock = MonotonicClock()
    times_ns = in_turns({name: partial(least_ns, [call], clock) for name, call in calls.items()}, turns)
    return {name: 1e-3 * time_ns for name, time_ns in times_ns.items()}
