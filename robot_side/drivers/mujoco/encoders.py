"""Joint encoders: noisy and rounded readings of the arm's true configuration (eq. 3)."""

import math
from typing import Any

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import FLOAT64, compiled, inlined, input_array, output_array


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
        readings = self.noise(true_positions.size)
        _read(readings, true_positions, self.sigma_rad, self.resolution_rad)
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


@compiled(output_array(1), input_array(1), FLOAT64, FLOAT64)
def _read(readings: FloatArray, true_positions: FloatArray, sigma: float, resolution: float) -> None:
    """Replace standard normal noise in `readings` by the readings with this noise."""
    for i in range(readings.size):
        readings[i] = reading(readings[i], true_positions[i], sigma, resolution)
