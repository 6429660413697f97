"""How far the gripper is enlarged so that a warning comes in time with probability P (eq. 8-10)."""

import math
from dataclasses import dataclass
from typing import Literal, overload

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from common.arrays import FloatArray, require_finite
from common.errors import ConfigurationError
from robot_side.compiled.kernel import NUMBER, TRUTH, compiled, input_array, output_array
from robot_side.enlargement.delay_displacement import require_age
from robot_side.enlargement.kinematic_error import VarianceMeasure, directional_variance, scalar_variance

_PER_AXIS_TO_LENGTH = math.sqrt(3.0)


def _standard_quantile(probability: npt.ArrayLike) -> FloatArray:
    """Φ⁻¹(P; 0, 1); ValueError for P outside (0, 1)."""
    p = np.asarray(probability, dtype=np.float64)
    if not ((p > 0.0) & (p < 1.0)).all():
        raise ValueError(f"probability = {p} is outside (0, 1); valid: 0 < probability < 1")
    return np.asarray(ndtri(p))


def _non_negative(name: str, value: npt.ArrayLike) -> FloatArray:
    """`value` as floats; ValueError that names it when an element is negative or not finite."""
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
    """Enlargement D_incr(P) = ΔT_d + max(0, Φ⁻¹(P; mean, variance)) in metres (eq. 9-10).

    probability: P in (0, 1). mean_m: the magnitude |μ_ee| + √3 |μ_c| (`combined_mean`), so never negative.
    variance_m2: σ_p² + σ_c² (`combined_variance`); with 0 the statistical part is the mean itself.
    delay_displacement_m: ΔT_d (`delay_displacement`). The arguments broadcast; a float for four scalars.
    ValueError for P outside (0, 1) and for any other argument that is negative or not finite.
    """
    z = _standard_quantile(probability)
    mean = _non_negative("mean_m", mean_m)
    variance = _non_negative("variance_m2", variance_m2)
    delay = _non_negative("delay_displacement_m", delay_displacement_m)
    distance = delay + np.maximum(0.0, mean + z * np.sqrt(variance))
    return float(distance) if np.ndim(distance) == 0 else distance


def combined_mean(kinematic_mean_m: float, camera_mean_m: float) -> float:
    """Mean |μ_ee| + √3 |μ_c| of eq. 10, metres: μ_c is the mean of each axis, so its vector is √3 as long."""
    return abs(kinematic_mean_m) + _PER_AXIS_TO_LENGTH * abs(camera_mean_m)


def combined_variance(kinematic_variance_m2: FloatArray, camera_sd_m: float) -> FloatArray:
    """Variance σ_p² + σ_c² of eq. 10, m²: the two errors are independent."""
    return kinematic_variance_m2 + camera_sd_m * camera_sd_m


@dataclass(frozen=True)
class EnlargementSettings:
    """What the enlargement is computed from, besides the arm's state."""

    probability: float = 0.99
    """P in (0, 1): how often the warning must come before the contact."""
    camera_mean_m: float = 0.0
    """μ_c of each axis, perceived minus true."""
    camera_sd_m: float = 0.0
    """σ_c of each axis."""
    kinematic_mean_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """μ_ee in the world frame, true minus estimated."""
    measure: VarianceMeasure = "isotropic"
    mode: Literal["once", "per_configuration"] = "per_configuration"
    """`once`: the largest variance over sampled configurations (the paper); else the present one's."""
    direction: Literal["isotropic", "towards_object"] = "isotropic"
    """`isotropic`: one distance a sphere (the paper); `towards_object`: one for each sphere and object."""
    fixed_m: float | None = None
    """An enlargement that is always the same, to compare with: eq. 8-10 are not used. None for none."""

    def __post_init__(self) -> None:
        try:
            _standard_quantile(self.probability)
            _non_negative("camera_sd_m", self.camera_sd_m)
            require_finite("camera_mean_m", np.asarray(self.camera_mean_m))
            require_finite("kinematic_mean_m", np.asarray(self.kinematic_mean_m))
            _non_negative("fixed_m", 0.0 if self.fixed_m is None else self.fixed_m)
        except ValueError as error:
            raise ConfigurationError(str(error)) from None
        for name, valid in (
            ("measure", ("isotropic", "trace")),
            ("mode", ("once", "per_configuration")),
            ("direction", ("isotropic", "towards_object")),
        ):
            if getattr(self, name) not in valid:
                raise ConfigurationError(f"{name} = {getattr(self, name)!r} is unknown; valid: {', '.join(valid)}")


class Enlargement:
    """The enlargement of each gripper sphere under one set of settings."""

    def __init__(self, settings: EnlargementSettings, sampled_covariances: FloatArray | None = None) -> None:
        """Prepare the parts that do not change.

        sampled_covariances (..., 3, 3): of every sphere in many configurations; `once` keeps the largest
        variance of all, for every sphere, and cannot do without (ValueError).
        """
        self.settings = settings
        self._z = float(_standard_quantile(settings.probability))
        self._mean_vector_m = np.asarray(settings.kinematic_mean_m) + settings.camera_mean_m
        self._mean_m = combined_mean(math.hypot(*settings.kinematic_mean_m), settings.camera_mean_m)
        self._variance_once_m2: float | None = None
        if settings.mode == "once":
            if sampled_covariances is None or sampled_covariances.size == 0:
                raise ValueError("sampled_covariances is missing; mode 'once' takes the largest over them")
            require_finite("sampled_covariances", sampled_covariances)
            self._variance_once_m2 = float(scalar_variance(sampled_covariances, settings.measure).max())

    def distances(self, covariances: FloatArray, velocities_m_s: FloatArray, loop_age_s: float) -> FloatArray:
        """Enlargement of each sphere (m,) in metres, the same towards every object (eq. 10).

        covariances (m, 3, 3) from `position_covariance`, not looked at in the mode `once`;
        velocities_m_s (m, 3) of the centres. With P >= 0.5 it is an upper bound of `distances_towards`.
        """
        require_age(loop_age_s)
        if self.settings.fixed_m is not None:
            return np.full(len(velocities_m_s), self.settings.fixed_m)
        if self._variance_once_m2 is None:
            variance_m2 = scalar_variance(covariances, self.settings.measure)
        else:
            variance_m2 = np.full(len(velocities_m_s), self._variance_once_m2)
        distances_m = np.empty(len(velocities_m_s))
        if not _distance_loop(
            np.ascontiguousarray(velocities_m_s),
            variance_m2,
            loop_age_s,
            self._mean_m,
            self.settings.camera_sd_m,
            self._z,
            distances_m,
        ):
            require_finite("velocities_m_s", velocities_m_s)
            require_finite("covariances", covariances)
        return distances_m

    def distances_towards(
        self,
        covariances: FloatArray,
        velocities_m_s: FloatArray,
        loop_age_s: float,
        directions: FloatArray,
    ) -> FloatArray:
        """Enlargement along unit directions û from spheres to objects, in metres.

        covariances (m, 3, 3) and velocities_m_s (m, 3) with directions (m, k, 3) give (m, k); for a list of
        pairs, index both by the pair's sphere and give directions (p, 3) for (p,). Eq. 10 with the mean
        û·(μ_ee + μ_c), the variance ûᵀΣû + σ_c² and the delay displacement max(0, v·û) t_d: the true gap
        is shorter than the perceived one by the sum of both errors' parts along û.
        """
        require_finite("velocities_m_s", velocities_m_s)
        require_age(loop_age_s)
        if self.settings.fixed_m is not None:
            return np.full(directions.shape[:-1], self.settings.fixed_m)
        variance = (
            directional_variance(covariances, directions)
            if self._variance_once_m2 is None
            else np.full(directions.shape[:-1], self._variance_once_m2)
        )
        sd = np.sqrt(combined_variance(variance, self.settings.camera_sd_m))
        statistical = np.maximum(0.0, directions @ self._mean_vector_m + self._z * sd)
        velocities = velocities_m_s if directions.ndim == 2 else velocities_m_s[:, None, :]
        closing_m_s: FloatArray = np.einsum("...i,...i->...", velocities, directions)
        return np.maximum(0.0, closing_m_s) * loop_age_s + statistical


@compiled(input_array(2), input_array(1), NUMBER, NUMBER, NUMBER, NUMBER, output_array(1), returns=TRUTH)
def _distance_loop(
    velocities: FloatArray,
    variances: FloatArray,
    loop_age: float,
    mean: float,
    camera_sd: float,
    z: float,
    distances: FloatArray,
) -> bool:
    """`enlargement_distance` with `delay_displacement` and `combined_variance` for each sphere; whether all is finite.

    z: Φ⁻¹(P; 0, 1).
    """
    finite = True
    for sphere in range(variances.size):
        quantile = mean + z * math.sqrt(variances[sphere] + camera_sd * camera_sd)
        speed = math.sqrt(velocities[sphere, 0] ** 2 + velocities[sphere, 1] ** 2 + velocities[sphere, 2] ** 2)
        distances[sphere] = speed * loop_age + max(quantile, 0.0)
        finite &= math.isfinite(speed * loop_age + quantile)
    return finite
