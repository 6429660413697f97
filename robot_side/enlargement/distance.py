"""Enlargement of the gripper, so large that a warning comes in time with probability P (eq. 9-10)."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from statistics import NormalDist
from typing import Final, overload

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray, require_finite
from common.errors import ConfigurationError
from robot_side.compiled.kernel import inlined
from robot_side.enlargement.prediction_errors import PredictionErrors

Vector3 = tuple[float, float, float]


_inverse: Final = np.vectorize(NormalDist().inv_cdf, otypes=[np.float64])


def standard_quantile(probability: npt.ArrayLike) -> FloatArray:
    """Return the standard normal quantile Φ⁻¹(P; 0, 1); ValueError for P outside (0, 1)."""
    p = np.asarray(probability, dtype=np.float64)
    if not ((p > 0.0) & (p < 1.0)).all():
        raise ValueError(f"probability = {p} is outside (0, 1); valid: 0 < probability < 1")
    return np.asarray(_inverse(p))


def _non_negative(name: str, value: npt.ArrayLike) -> FloatArray:
    """Return `value` as floats; ValueError that mentions `name` if an element is negative or not finite."""
    values = np.asarray(value, dtype=np.float64)
    if not (np.isfinite(values) & (values >= 0.0)).all():
        raise ValueError(f"{name} = {values} is negative or not finite; valid: finite and at least 0")
    return values


@overload
def enlargement_distance(
    probability: float, mean_m: float, variance_m2: float, delay_displacement_m: float
) -> float: ...


@overload
def enlargement_distance(
    probability: npt.ArrayLike,
    mean_m: npt.ArrayLike,
    variance_m2: npt.ArrayLike,
    delay_displacement_m: npt.ArrayLike,
) -> float | FloatArray: ...


def enlargement_distance(
    probability: npt.ArrayLike,
    mean_m: npt.ArrayLike,
    variance_m2: npt.ArrayLike,
    delay_displacement_m: npt.ArrayLike,
) -> float | FloatArray:
    """Return the enlargement D_incr(P) = ΔT_d + max(0, Φ⁻¹(P; mean, variance)) in metres (eq. 9-10).

    probability: P in (0, 1). mean_m: a sum of magnitudes |μ_ee| + √3 |μ_c|, so never negative.
    variance_m2: σ_p² + σ_c²; if 0, the statistical part is the mean itself.
    delay_displacement_m: ΔT_d = |v| t_d (eq. 8). The arguments broadcast; four scalars give a float.
    ValueError for P outside (0, 1) and for any other argument that is negative or not finite.
    """
    z = standard_quantile(probability)
    mean = _non_negative("mean_m", mean_m)
    variance = _non_negative("variance_m2", variance_m2)
    delay = _non_negative("delay_displacement_m", delay_displacement_m)
    distance = delay + np.maximum(mean + z * np.sqrt(variance), 0.0)
    return float(distance) if np.ndim(distance) == 0 else distance


@inlined
def statistical_distance(mean: float, variance: float, quantile: float) -> float:
    """Return D_σ = max(0, μ + Φ⁻¹(P) √σ²), lengths in m (eq. 9-10); all laws and explanations use this one formula."""
    return max(0.0, mean + quantile * math.sqrt(variance))


@dataclass(frozen=True)
class Uncertainty:
    """Errors of gripper, camera and delay prediction, and the probability P (eq. 9-10), in the world frame."""

    probability: float = 0.99
    """Probability P in (0, 1) that the warning comes before the contact, in an approach of one surface (one-sided)"""
    camera_mean_m: Vector3 = (0.0, 0.0, 0.0)
    """Mean μ_c of the camera's error, true minus perceived position"""
    camera_sd_m: float = 0.0
    """Standard deviation σ_c of the camera's error along each axis, of objects that say none of their own"""
    kinematic_mean_m: Vector3 = (0.0, 0.0, 0.0)
    """Mean μ_ee of the gripper's position error, true minus estimated position"""
    prediction: PredictionErrors = field(default_factory=PredictionErrors)
    """Errors μ_δ and σ_δ of the predicted delay displacement"""

    def __post_init__(self) -> None:
        try:
            standard_quantile(self.probability)
            _non_negative("camera_sd_m", self.camera_sd_m)
            require_finite("camera_mean_m", np.asarray(self.camera_mean_m))
            require_finite("kinematic_mean_m", np.asarray(self.kinematic_mean_m))
        except ValueError as error:
            raise ConfigurationError(str(error)) from None

    @cached_property
    def quantile(self) -> float:
        """Standard normal quantile Φ⁻¹(P)"""
        return float(standard_quantile(self.probability))

    @cached_property
    def mean_m(self) -> FloatArray:
        """Mean μ_ee - μ_c (3,) of the gripper's and the camera's errors together"""
        mean_m: FloatArray = np.asarray(self.kinematic_mean_m) - np.asarray(self.camera_mean_m)
        return mean_m

    def mean_along_m(self, direction: FloatArray) -> float:
        """Return û·(μ_ee - μ_c) for a unit vector û = `direction` (3,): how much nearer objects are than perceived."""
        return float(direction @ self.mean_m)


def plain_enlargements_m(
    uncertainty: Uncertainty,
    covariances: FloatArray,
    velocities_m_s: FloatArray,
    loop_age_s: float,
    camera: tuple[float, float] | None = None,
) -> FloatArray:
    """Return D_incr (m,) of each sphere as the paper prints it: equal in all directions, from |v| t_d and Σ's trace.

    The length of μ_c is the vector's: √3 times the mean along one axis if all axes have the same mean.
    covariances (m, 3, 3) from `position_covariance`, velocities_m_s (m, 3) of the spheres' centres. camera: unseen
    motion in m and σ_c² in m² of an object; None: those of `uncertainty`.
    """
    unseen_m, camera_m2 = (0.0, uncertainty.camera_sd_m**2) if camera is None else camera
    mean_m = unseen_m + math.hypot(*uncertainty.kinematic_mean_m) + math.hypot(*uncertainty.camera_mean_m)
    variance_m2 = np.trace(covariances, axis1=-2, axis2=-1) + camera_m2
    speeds_m_s = np.sqrt(np.einsum("mi,mi->m", velocities_m_s, velocities_m_s))
    found = enlargement_distance(uncertainty.probability, mean_m, variance_m2, speeds_m_s * loop_age_s)
    return np.asarray(found)
