"""How far the encoders' errors put a point of the gripper off: eq. 5 and what could stand in its place.

The truth is a Monte Carlo of the exact kinematics, with its own standard error.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from common.arrays import FloatArray
from feelahead.benchmarks.error.chain import Chain
from feelahead.benchmarks.error.gripper import PosedGripper
from robot_side.arm.port import GripperPose
from robot_side.enlargement.kinematic_error import directional_variance, position_covariance

NOISE_RAD = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""Standard deviations of every joint's error."""
PROBABILITY = 0.99
"""P of eq. 10, whose quantile the enlargement needs."""
SAMPLED = 256
"""Configurations over which `once` takes the largest variance, as the robot side does."""
BATCHES = 20
"""The draws in so many parts: how much these differ tells the standard error of the whole."""
METHODS = ("linear", "once", "unscented")

Displacements = Callable[[FloatArray], FloatArray]
"""Joint errors (k, n) to a point's displacements (k, 3)."""


@dataclass(frozen=True)
class Estimate:
    """A point's error along the approach axis, and as a whole."""

    mean_m: float
    sd_m: float
    covariance_m2: FloatArray
    """(3, 3) in the world frame"""

    @property
    def quantile_m(self) -> float:
        """What eq. 10 takes for the quantile at P: that of a normal distribution."""
        return self.mean_m + float(ndtri(PROBABILITY)) * self.sd_m


@dataclass(frozen=True)
class Truth:
    """What very many draws say, and how sure that is (one standard error)."""

    mean_m: float
    sd_m: float
    sd_error_m: float
    quantile_m: float
    quantile_error_m: float
    covariance_m2: FloatArray


@dataclass(frozen=True)
class Outcome:
    """One point in one configuration with one joint noise."""

    place: str
    point: str
    noise_rad: float
    truth: Truth
    estimates: Mapping[str, Estimate]
    """By METHODS."""

    def sd_error(self, method: str) -> float:
        """Relative error of the standard deviation along the approach axis."""
        return self.estimates[method].sd_m / self.truth.sd_m - 1.0

    def covariance_error(self, method: str) -> float:
        """Relative error of the whole covariance (Frobenius norm)."""
        off = self.estimates[method].covariance_m2 - self.truth.covariance_m2
        return float(np.linalg.norm(off) / np.linalg.norm(self.truth.covariance_m2))

    def quantile_error_m(self, method: str) -> float:
        """Error of the distance that eq. 10 needs; above 0 is too far, on the safe side."""
        return self.estimates[method].quantile_m - self.truth.quantile_m

    def quantile_error(self, method: str) -> float:
        """The same as a share of the true distance."""
        return self.quantile_error_m(method) / self.truth.quantile_m


def linear(jacobian: FloatArray, noise_rad: float, axis: FloatArray) -> Estimate:
    """Eq. 5 in this configuration: Σ = J diag(σ²) Jᵀ, mean 0; jacobian (3, n) of the point."""
    covariances = position_covariance(jacobian[None], np.full(jacobian.shape[1], noise_rad))
    return Estimate(0.0, float(np.sqrt(directional_variance(covariances, axis[None])[0])), covariances[0])


def once(largest_variance_per_rad2: float, noise_rad: float) -> Estimate:
    """The paper's: the largest variance of all sampled configurations, in every direction."""
    variance_m2 = largest_variance_per_rad2 * noise_rad * noise_rad
    return Estimate(0.0, float(np.sqrt(variance_m2)), variance_m2 * np.eye(3))


def unscented(displacements: Displacements, joints: int, noise_rad: float, axis: FloatArray) -> Estimate:
    """2n + 1 evaluations: none, and each joint alone by ±√3 σ, κ = 3 - n (Julier and Uhlmann 1997)."""
    step = np.sqrt(3.0) * noise_rad * np.eye(joints)
    points = displacements(np.concatenate([np.zeros((1, joints)), step, -step]))
    weights = np.concatenate([[1.0 - joints / 3.0], np.full(2 * joints, 1.0 / 6.0)])
    mean = weights @ points
    off = points - mean
    covariance = (weights[:, None] * off).T @ off
    # The first weight is negative from n = 4 on, and so the variance may be.
    return Estimate(float(mean @ axis), float(np.sqrt(max(float(axis @ covariance @ axis), 0.0))), covariance)


def monte_carlo(displacements: Displacements, errors_rad: FloatArray, axis: FloatArray) -> Truth:
    """The truth from the joint errors (k, n), k a multiple of BATCHES."""
    points = np.concatenate([displacements(batch) for batch in np.split(errors_rad, BATCHES)])
    along = points @ axis
    batches = along.reshape(BATCHES, -1)
    quantiles = np.quantile(batches, PROBABILITY, axis=1)
    certainty = 1.0 / np.sqrt(BATCHES)
    return Truth(
        mean_m=float(along.mean()),
        sd_m=float(along.std()),
        sd_error_m=float(batches.std(axis=1).std(ddof=1) * certainty),
        quantile_m=float(np.quantile(along, PROBABILITY)),
        quantile_error_m=float(quantiles.std(ddof=1) * certainty),
        covariance_m2=np.cov(points.T),
    )


def places(gripper: PosedGripper, count: int, seed: int) -> dict[str, FloatArray]:
    """Configurations (n,) by name: home, `count` seeded ones within the joints' ranges, and a singular one.

    The singular one has, of SAMPLED ones, the least error along the approach beside the largest in any direction.
    """
    generator = np.random.default_rng([seed, 1])
    drawn = generator.uniform(gripper.lower_rad, gripper.upper_rad, (count, len(gripper.home_rad)))
    found = {"home": gripper.home_rad} | {f"random {number}": row for number, row in enumerate(drawn, 1)}
    return found | {"singular": min(sampled_configurations(gripper, seed), key=lambda at: _share_along(gripper, at))}


def sampled_configurations(gripper: PosedGripper, seed: int) -> FloatArray:
    """(SAMPLED, n), all over the joints' ranges."""
    generator = np.random.default_rng([seed, 2])
    return generator.uniform(gripper.lower_rad, gripper.upper_rad, (SAMPLED, len(gripper.home_rad)))


def _share_along(gripper: PosedGripper, configuration: FloatArray) -> float:
    pose = gripper.at(configuration)
    estimate = linear(pose.tool_jacobian[:3], 1.0, pose.tool_rotation[:, 2])
    return estimate.sd_m**2 / largest_eigenvalue(estimate.covariance_m2)


def largest_variance(gripper: PosedGripper, seed: int) -> float:
    """m²/rad²: the largest eigenvalue of J Jᵀ of any sphere in any sampled configuration."""
    unit = np.ones(len(gripper.home_rad))
    return max(
        largest_eigenvalue(position_covariance(gripper.at(configuration).sphere_jacobians, unit))
        for configuration in sampled_configurations(gripper, seed)
    )


def points(pose: GripperPose) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Position (3,) and Jacobian (3, n) of the tool's point and of the gripper's sphere farthest from it."""
    farthest = int(np.argmax(np.linalg.norm(pose.sphere_centers_m - pose.tool_position_m, axis=1)))
    return {
        "tool": (pose.tool_position_m, pose.tool_jacobian[:3]),
        "far sphere": (pose.sphere_centers_m[farthest], pose.sphere_jacobians[farthest]),
    }


def largest_eigenvalue(covariances: FloatArray) -> float:
    """The variance in the worst direction, of all covariances (..., 3, 3)."""
    return float(np.linalg.eigvalsh(covariances).max())


def measure_propagation(
    gripper: PosedGripper, configurations: int, draws: int, seed: int, advance: Callable[[], None]
) -> Iterator[Outcome]:
    """Every place, point and noise; `advance` is called after each place. `draws` is a multiple of BATCHES."""
    largest = largest_variance(gripper, seed)
    for number, (place, configuration) in enumerate(places(gripper, configurations, seed).items()):
        pose = gripper.at(configuration)
        axis, joints = pose.tool_rotation[:, 2], len(configuration)
        standard = np.random.default_rng([seed, 3, number]).standard_normal((draws, joints))
        for point, (position, jacobian) in points(pose).items():
            chain = Chain(pose.tool_jacobian, pose.tool_position_m, position)
            for noise_rad in NOISE_RAD:
                yield Outcome(
                    place,
                    point,
                    noise_rad,
                    monte_carlo(chain.displacements, noise_rad * standard, axis),
                    {
                        "linear": linear(jacobian, noise_rad, axis),
                        "once": once(largest, noise_rad),
                        "unscented": unscented(chain.displacements, joints, noise_rad, axis),
                    },
                )
        advance()
