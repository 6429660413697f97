"""Direction of a look, and what is uncertain along it; a file of its own, as a law without looks needs it, too."""

from dataclasses import dataclass

from common.arrays import FloatArray


@dataclass(frozen=True)
class Along:
    """Direction of a look, and the uncertainty along it (eq. 9-10)."""

    direction: FloatArray
    """û (3,), unit, in the world frame"""
    mean_m: float
    """Mean error of arm and camera along û: û·(μ_ee - μ_c)"""
    variance_m2: float
    """Variance of the camera's error: σ_c², the largest of all objects"""
    quantile: float
    """Standard normal quantile of the probability P: Φ⁻¹(P)"""
    reach_m: float
    """Distance that is examined along û"""
    mean_along_m: float = 0.0
    """Mean prediction error of the delay displacement: μ_δ"""
    variance_along_m2: float = 0.0
    """Variance of the prediction error: σ_δ²"""
    approach_m: FloatArray | None = None
    """Distance by which each object (k,) approaches; its contact distances are shortened by it. None: all at rest."""
    unseen_m: float = 0.0
    """Distance by which an object may have moved unseen, the largest of all objects; D_σ grows by it."""
    of_objects: FloatArray | None = None
    """(k, 2) each object's own `unseen_m` and `variance_m2`, see `object_errors`. None: all objects have the same."""
