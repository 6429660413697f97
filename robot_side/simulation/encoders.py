"""Joint encoders: what the arm's sensors say of its true configuration (eq. 3)."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import NUMBER, compiled, input_array, output_array


class Encoder:
    """An absolute encoder on every joint: white noise, then rounding to whole steps.

    The defaults are assumptions, not one arm's specification: a 15-bit ring on the joint's output, a usual
    class for collaborative arms, and 0.2 mrad for what calibration, eccentricity and gear flex leave over.
    """

    def __init__(self, sigma_rad: float = 2e-4, resolution_rad: float = 2.0 * math.pi / 2**15, seed: int = 0) -> None:
        """Seed the noise; a step of 0 is none."""
        self._sigma_rad = sigma_rad
        self._resolution_rad = resolution_rad
        self._noise = np.random.default_rng(seed)

    def read(self, true_positions: FloatArray) -> FloatArray:
        """Readings (n,) of joints that stand at `true_positions` (n,), radians; metres for a prismatic joint."""
        readings: FloatArray = self._noise.standard_normal(true_positions.shape)
        _read(readings, true_positions, self._sigma_rad, self._resolution_rad)
        return readings

    def standard_deviation_rad(self) -> float:
        """Standard deviation of one reading's error: noise and rounding, which are independent (eq. 3)."""
        return float(np.hypot(self._sigma_rad, self._resolution_rad / math.sqrt(12.0)))


@compiled(output_array(1), input_array(1), NUMBER, NUMBER)
def _read(readings: FloatArray, true_positions: FloatArray, sigma: float, resolution: float) -> None:
    """Make readings of standard normal noise."""
    for i in range(readings.size):
        readings[i] = readings[i] * sigma + true_positions[i]
        if resolution > 0.0:
            readings[i] = np.rint(readings[i] / resolution) * resolution
