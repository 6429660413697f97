"""Joint encoders: noisy and rounded readings of the arm's true configuration (eq. 3)."""

import math
from typing import Any

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined


class Encoder:
    """Absolute encoder on every joint: adds white noise, then rounds to whole steps.

    The defaults are assumptions, not one arm's specification. They are a 15-bit ring on the joint's output, a usual
    class for collaborative arms, and 0.2 mrad for remaining errors of calibration, eccentricity and gear flex.
    """

    def __init__(self, sigma_rad: float = 2e-4, resolution_rad: float = 2.0 * math.pi / 2**15, seed: int = 0) -> None:
        """Seed the noise; a resolution of 0 means that readings are not rounded."""
        self.sigma_rad = sigma_rad
        self.resolution_rad = resolution_rad
        self._noise = np.random.default_rng(seed)

    def read(self, true_positions: FloatArray) -> FloatArray:
        """Return the readings (n,) of joints at `true_positions` (n,), in radians; metres for a prismatic joint."""
        readings = true_positions + self.sigma_rad * self.noise(true_positions.size)
        if self.resolution_rad > 0.0:
            readings = np.rint(readings / self.resolution_rad) * self.resolution_rad
        return readings

    def noise(self, count: int) -> FloatArray:
        """Draw `count` standard normal numbers, which are the noise of the next readings."""
        drawn: FloatArray = self._noise.standard_normal(count)
        return drawn

    def standard_deviation_rad(self) -> float:
        """Return the standard deviation of one reading's error: noise and rounding, which are independent (eq. 3)."""
        return float(np.hypot(self.sigma_rad, self.resolution_rad / math.sqrt(12.0)))


@inlined
def reading(noise: float, true_position: float, sigma: float, resolution: float) -> Any:
    """Return a reading of `true_position`; noise: a standard normal number."""
    read = noise * sigma + true_position
    return np.rint(read / resolution) * resolution if resolution > 0.0 else read
