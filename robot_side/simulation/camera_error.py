"""How wrong a camera is about where things are (eq. 1-2)."""

import math
import zlib

import numpy as np

from common.arrays import FloatArray


class CameraError:
    """The error e_c ~ N(μ_c, σ_c²) per axis of each object's position (eq. 1-2), world frame: perceived = true - e_c.

    One part stays with the object for the whole run, as a calibration or segmentation error does; an optional
    part with mean 0 is drawn anew in each frame. What an object gets depends on the seed and its own name
    alone, so that adding or removing other objects changes nothing.
    """

    def __init__(
        self,
        names: tuple[str, ...],
        mean_m: float | tuple[float, float, float] = 0.0,
        standard_deviation_m: float = 0.0,
        frame_standard_deviation_m: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Draw the lasting part for `names` (k); mean_m: of every axis, or of each. ValueError for what cannot be."""
        if not np.isfinite(mean_m).all():
            raise ValueError(f"mean_m = {mean_m}; valid: finite")
        for name, value in (
            ("standard_deviation_m", standard_deviation_m),
            ("frame_standard_deviation_m", frame_standard_deviation_m),
            ("seed", seed),
        ):
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} = {value}; valid: finite and 0 or more")
        self.mean_m: FloatArray = np.broadcast_to(np.asarray(mean_m, dtype=np.float64), (3,)).copy()
        """(3,) μ_c"""
        self.variance_m2 = standard_deviation_m**2 + frame_standard_deviation_m**2
        """σ_c² of eq. 2 for a single frame: both parts together."""
        self._frame_standard_deviation_m = frame_standard_deviation_m
        self._generators = [np.random.default_rng([seed, zlib.crc32(name.encode())]) for name in names]
        self._lasting = self.mean_m + standard_deviation_m * self._draw()

    def next_frame(self) -> FloatArray:
        """Offsets -e_c (k, 3) to add to the true positions in the next frame, metres, in the order of the names."""
        if self._frame_standard_deviation_m == 0.0:
            return -self._lasting
        offsets: FloatArray = -(self._lasting + self._frame_standard_deviation_m * self._draw())
        return offsets

    def _draw(self) -> FloatArray:
        draws: FloatArray = np.array([generator.standard_normal(3) for generator in self._generators])
        return draws.reshape(-1, 3)
