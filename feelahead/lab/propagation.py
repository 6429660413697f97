"""The error of a point of the gripper from the encoders' errors: eq. 5 and its alternatives.

The truth is a Monte Carlo of the exact kinematics, with its own standard error.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from scipy.special import ndtri

from common.arrays import FloatArray
from feelahead.lab.table import Row, Table
from robot_side.arm.port import ArmState, GripperPose
from robot_side.enlargement.kinematic_error import directional_variance, position_covariance
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import Scene

NOISE_RAD: Final = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""Standard deviations of every joint's error."""
PROBABILITY: Final = 0.99
"""P of eq. 10, whose quantile the enlargement needs."""
BATCHES: Final = 20
"""Number of parts of the draws, whose spread gives the standard error of the whole."""
METHODS: Final = ("linear", "once", "unscented")
SINGULAR: Final = "singular"
DRAWS: Final = {f"Monte Carlo, {draws}": draws for draws in (100, 1_000, 10_000)}
"""The Monte Carlos whose run time is measured."""
_SAMPLED: Final = 256
"""Configurations over which `once` takes the largest variance, as the robot side does."""
_FAILS_PERCENT: Final = 5.0
"""Beyond this relative error a method has failed."""
_PIECE_S: Final = 0.001
_ENCODER_RAD: Final = 2e-4

Displacements = Callable[[FloatArray], FloatArray]
"""Joint errors (k, n) to a point's displacements (k, 3)."""


class Chain:
    """One point carried by n joints, near one configuration, as a product of exponentials (Brockett 1984).

    x = exp(ξ₁ δ₁) ... exp(ξₙ δₙ) p with the joints' screws ξ at that configuration, base to tip: joint i turns all
    that is beyond it about its axis there, by δᵢ. The screws are the columns of the geometric Jacobian, so that no
    other model of the robot is needed.
    """

    def __init__(self, jacobian: FloatArray, tool_position_m: FloatArray, point_m: FloatArray) -> None:
        """jacobian (6, n) of the tool's point, linear rows first, base to tip; all in the world frame.

        point_m (3,): the point to follow, anywhere on what the last joint moves.
        """
        self._point_m = point_m
        self._axes = np.ascontiguousarray(jacobian[3:].T)
        self._linear = np.ascontiguousarray(jacobian[:3].T)
        # ω × (p - c) = v with c on the axis: c = p - v × ω, as |ω| = 1.
        self._on_axes_m = tool_position_m - np.cross(self._linear, self._axes)

    def displacements(self, changes_rad: FloatArray) -> FloatArray:
        """Move the joints by (k, n), and return the point's displacements (k, 3) in metres.

        The difference itself is added up: changes of 1e-5 rad keep their digits.
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
    """The gripper by eq. 4 in any configuration; the fingers stay as the scene starts."""

    def __init__(self, scene: Scene) -> None:
        robot = scene.robot
        self.home_rad: FloatArray = scene.data.qpos[robot.arm_positions].copy()
        # A joint without limits is taken over one turn.
        self.lower_rad: FloatArray = np.where(np.isfinite(robot.lower_rad), robot.lower_rad, -np.pi)
        self.upper_rad: FloatArray = np.where(np.isfinite(robot.upper_rad), robot.upper_rad, np.pi)
        self._fingers = scene.data.qpos[robot.finger_positions].copy()
        self._kinematics = MujocoKinematics(scene)

    def at(self, joint_positions_rad: FloatArray) -> GripperPose:
        """Pose the gripper with its joints (n,)."""
        still = np.zeros_like(joint_positions_rad)
        return self._kinematics.pose(ArmState(0.0, joint_positions_rad, still, self._fingers, 0.0, False))


@dataclass(frozen=True)
class Estimate:
    """A point's error along the approach axis, and as a whole."""

    mean_m: float
    sd_m: float
    covariance_m2: FloatArray
    """(3, 3) in the world frame"""

    @property
    def quantile_m(self) -> float:
        """The quantile at P of a normal distribution, as eq. 10 takes it."""
        return self.mean_m + float(ndtri(PROBABILITY)) * self.sd_m


@dataclass(frozen=True)
class Truth(Estimate):
    """The distribution of very many draws, and its standard errors."""

    sd_error_m: float
    true_quantile_m: float
    quantile_error_m: float


def linear(jacobian: FloatArray, noise_rad: float, axis: FloatArray) -> Estimate:
    """Eq. 5 in this configuration: Σ = J diag(σ²) Jᵀ, mean 0; jacobian (3, n) of the point."""
    covariances = position_covariance(jacobian[None], np.full(jacobian.shape[1], noise_rad))
    return Estimate(0.0, float(np.sqrt(directional_variance(covariances, axis[None])[0])), covariances[0])


def once(largest_variance_per_rad2: float, noise_rad: float) -> Estimate:
    """The paper's way: the largest variance of all sampled configurations, in every direction."""
    variance_m2 = largest_variance_per_rad2 * noise_rad * noise_rad
    return Estimate(0.0, float(np.sqrt(variance_m2)), variance_m2 * np.eye(3))


def unscented(displacements: Displacements, joints: int, noise_rad: float, axis: FloatArray) -> Estimate:
    """Unscented transform of 2n + 1 points: none, and each joint alone by ±√3 σ, κ = 3 - n (Julier, Uhlmann 1997)."""
    step = np.sqrt(3.0) * noise_rad * np.eye(joints)
    points = displacements(np.concatenate([np.zeros((1, joints)), step, -step]))
    weights = np.concatenate([[1.0 - joints / 3.0], np.full(2 * joints, 1.0 / 6.0)])
    mean = weights @ points
    off = points - mean
    covariance = (weights[:, None] * off).T @ off
    # The first weight is negative from n = 4 on, and so the variance may be.
    return Estimate(float(mean @ axis), float(np.sqrt(max(float(axis @ covariance @ axis), 0.0))), covariance)


def monte_carlo(displacements: Displacements, errors_rad: FloatArray, axis: FloatArray) -> Truth:
    """Take the truth from the joint errors (k, n), k a multiple of BATCHES."""
    points = np.concatenate([displacements(batch) for batch in np.split(errors_rad, BATCHES)])
    along = points @ axis
    batches = along.reshape(BATCHES, -1)
    quantiles = np.quantile(batches, PROBABILITY, axis=1)
    certainty = 1.0 / np.sqrt(BATCHES)
    return Truth(
        mean_m=float(along.mean()),
        sd_m=float(along.std()),
        covariance_m2=np.cov(points.T),
        sd_error_m=float(batches.std(axis=1).std(ddof=1) * certainty),
        true_quantile_m=float(np.quantile(along, PROBABILITY)),
        quantile_error_m=float(quantiles.std(ddof=1) * certainty),
    )


def places(gripper: PosedGripper, count: int, seed: int) -> dict[str, FloatArray]:
    """Name configurations (n,): home, `count` seeded ones within the joints' ranges, and a singular one.

    The singular one has, of all sampled ones, the least error along the approach beside the largest in any direction.
    """
    generator = np.random.default_rng([seed, 1])
    drawn = generator.uniform(gripper.lower_rad, gripper.upper_rad, (count, len(gripper.home_rad)))
    found = {"home": gripper.home_rad} | {f"random {number}": row for number, row in enumerate(drawn, 1)}
    return found | {SINGULAR: min(_sampled(gripper, seed), key=lambda at: _share_along(gripper, at))}


def _sampled(gripper: PosedGripper, seed: int) -> FloatArray:
    """(_SAMPLED, n), all over the joints' ranges."""
    generator = np.random.default_rng([seed, 2])
    return generator.uniform(gripper.lower_rad, gripper.upper_rad, (_SAMPLED, len(gripper.home_rad)))


def _share_along(gripper: PosedGripper, configuration: FloatArray) -> float:
    pose = gripper.at(configuration)
    estimate = linear(pose.tool_jacobian[:3], 1.0, pose.tool_rotation[:, 2])
    return estimate.sd_m**2 / _largest_eigenvalue(estimate.covariance_m2)


def largest_variance(gripper: PosedGripper, seed: int) -> float:
    """Find the largest eigenvalue of J Jᵀ, m²/rad², of any sphere in any sampled configuration."""
    unit = np.ones(len(gripper.home_rad))
    return max(
        _largest_eigenvalue(position_covariance(gripper.at(configuration).sphere_jacobians, unit))
        for configuration in _sampled(gripper, seed)
    )


def _largest_eigenvalue(covariances: FloatArray) -> float:
    return float(np.linalg.eigvalsh(covariances).max())


def measure(gripper: PosedGripper, number: int, configurations: int, draws: int, seed: int) -> Iterator[Row]:
    """Make a row for each point and noise in the configuration with this number; `draws` a multiple of BATCHES.

    The points are the tool's and the centre of the gripper's sphere farthest from it. Errors are relative to the
    truth, but for the quantile: above 0 mm the enlargement is too far, on the safe side.
    """
    largest = largest_variance(gripper, seed)
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
            truth = monte_carlo(chain.displacements, noise_rad * standard, axis)
            estimates = {
                "linear": linear(jacobian, noise_rad, axis),
                "once": once(largest, noise_rad),
                "unscented": unscented(chain.displacements, joints, noise_rad, axis),
            }
            yield {"place": place, "point": point, "noise_rad": noise_rad} | errors(truth, estimates)


def errors(truth: Truth, estimates: Mapping[str, Estimate]) -> Row:
    """Compare estimates with the truth."""
    row = {
        "mean_mm": 1e3 * truth.mean_m,
        "sd_mm": 1e3 * truth.sd_m,
        "sd_uncertainty_percent": 100.0 * truth.sd_error_m / truth.sd_m,
        "quantile_mm": 1e3 * truth.true_quantile_m,
        "quantile_uncertainty_mm": 1e3 * truth.quantile_error_m,
    }
    size = np.linalg.norm(truth.covariance_m2)
    for method, found in estimates.items():
        off = float(np.linalg.norm(found.covariance_m2 - truth.covariance_m2) / size)
        row |= {
            f"{method}_mean_mm": 1e3 * found.mean_m,
            f"{method}_sd_error_percent": 100.0 * (found.sd_m / truth.sd_m - 1.0),
            f"{method}_covariance_error_percent": 100.0 * off,
            f"{method}_quantile_error_mm": 1e3 * (found.quantile_m - truth.true_quantile_m),
        }
    return row


def failures(propagated: Table) -> Iterator[str]:
    """Say from which joint noise on the linear propagation is off by more than 5 %."""
    relative: dict[str, Callable[[Row], float]] = {
        "standard deviation": lambda row: row["linear_sd_error_percent"],
        f"quantile at {PROBABILITY:g}": lambda row: 100.0 * row["linear_quantile_error_mm"] / row["quantile_mm"],
    }
    groups: dict[str, list[Row]] = {"at home": [], "in the random configurations": [], "in the singular one": []}
    for row in propagated:
        where = {"home": "at home", SINGULAR: "in the singular one"}.get(row["place"], "in the random configurations")
        groups[where].append(row)
    for what, error in relative.items():
        parts = []
        for where, rows in groups.items():
            off = {row["noise_rad"] for row in rows if abs(error(row)) > _FAILS_PERCENT}
            parts.append(f"{where} from {min(off):g} rad on" if off else f"{where} not up to {max(NOISE_RAD):g} rad")
        yield f"linear, {what}: off by more than {_FAILS_PERCENT:g} % {', '.join(parts)}"


def run_times_us(gripper: PosedGripper, rounds: int, seed: int) -> dict[str, float]:
    """Measure processor time of one call of each method at home, the best of `rounds` pieces of a millisecond.

    The pieces take turns, so that other load on the machine hits every method. One point and one direction. "linear"
    has the Jacobian at hand, as a tick has. "unscented" takes 2n + 1 poses one by one, Monte Carlo all at a time.
    """
    pose = gripper.at(gripper.home_rad)
    axis, joints = pose.tool_rotation[:, 2], len(gripper.home_rad)
    jacobians, axes, noise = pose.tool_jacobian[None, :3], axis[None], np.full(joints, _ENCODER_RAD)
    chain = Chain(pose.tool_jacobian, pose.tool_position_m, pose.tool_position_m)
    generator = np.random.default_rng(0)

    def by_poses(changes_rad: FloatArray) -> FloatArray:
        return np.array([gripper.at(gripper.home_rad + change).tool_position_m for change in changes_rad])

    def with_kinematics() -> object:
        here = gripper.at(gripper.home_rad)
        return linear(here.tool_jacobian[:3], _ENCODER_RAD, here.tool_rotation[:, 2])

    def by_draws(draws: int) -> object:
        return (chain.displacements(_ENCODER_RAD * generator.standard_normal((draws, joints))) @ axis).std()

    calls: dict[str, Callable[[], object]] = {
        "linear": lambda: directional_variance(position_covariance(jacobians, noise), axes),
        "linear, with kinematics": with_kinematics,
        "unscented": lambda: unscented(by_poses, joints, _ENCODER_RAD, axis),
    }
    calls |= {name: partial(by_draws, draws) for name, draws in DRAWS.items()}
    for call in calls.values():
        call()
    repeats = {name: max(1, round(_PIECE_S / max(_seconds(call), 1e-9))) for name, call in calls.items()}
    best_s = dict.fromkeys(calls, float("inf"))
    for _ in range(rounds):
        for name, call in calls.items():
            best_s[name] = min(best_s[name], _seconds(call, repeats[name]) / repeats[name])
    best_s["once, at the start"] = _seconds(lambda: largest_variance(gripper, seed))
    return {name: 1e6 * seconds for name, seconds in best_s.items()}


def _seconds(call: Callable[[], object], repeats: int = 1) -> float:
    start_s = time.thread_time()
    for _ in range(repeats):
        call()
    return time.thread_time() - start_s
