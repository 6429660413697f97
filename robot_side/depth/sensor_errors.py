"""Pictures of true depth become those of a camera that errs: in disparity, at edges, and by holes."""

import itertools
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from robot_side.depth.picture import DepthArray, Pinhole
from robot_side.depth.sensors import SensorErrors

_GRAZING: Final = math.radians(10.0)
"""Angle to the line of sight from which on a surface is no edge"""
_NEAREST_M: Final = 1e-3


class ErrorMaker:
    """Camera's errors, drawn picture by picture; some are drawn once, for the whole run."""

    def __init__(
        self, sensor: SensorErrors, pinhole: Pinhole, shape: tuple[int, int], seed: int, level: float = 1.0
    ) -> None:
        """shape: (h, w) of the pictures. level: factor on all errors; 0: none but the range. ValueError if below 0."""
        if not level >= 0.0:
            raise ValueError(f"level = {level}; valid: 0 or more")
        self._sensor, self._level, self._shape = sensor, level, shape
        self._generator = np.random.default_rng(seed)
        length_px = sensor.correlation_px * pinhole.fx / sensor.focal_px
        self._kept = math.exp(-1.0 / length_px) if length_px > 0.0 else 0.0
        # By this share of its depth a surface at that angle falls back over three pixels.
        self._edge = 2.0 / (pinhole.fx * math.tan(_GRAZING))
        self._constant = np.float32(level * math.sqrt(sensor.constant_share)) * self._field()

    def apply(self, true_depth_m: DepthArray) -> DepthArray:
        """Return what the camera measures of the true depth (h, w), 0 where there is none, in its next picture."""
        sensor, level = self._sensor, self._level
        depth_m = true_depth_m
        if level > 0.0:
            error = self._constant + np.float32(level * math.sqrt(1.0 - sensor.constant_share)) * self._field()
            inverse = 1.0 / np.maximum(depth_m, np.float32(_NEAREST_M))
            per_error = sensor.growth_per_m + (sensor.floor_m * inverse * inverse if sensor.floor_m > 0.0 else 0.0)
            inverse += per_error * error
            if (step_per_m := level * sensor.step_per_m) > 0.0:
                inverse = np.rint(inverse / np.float32(step_per_m)) * np.float32(step_per_m)
            # Beyond any range where the error exceeds 1/z.
            measured_m = np.where(inverse > 0.0, 1.0 / np.maximum(inverse, np.float32(1e-6)), np.float32(np.inf))
            measured_m[depth_m <= 0.0] = 0.0
            self._err_at_edges(depth_m, measured_m)
            count = self._generator.poisson(level * sensor.drop_out_share * measured_m.size)
            measured_m.flat[self._generator.integers(measured_m.size, size=count)] = 0.0
            depth_m = measured_m
        measures = (depth_m >= sensor.least_m) & (depth_m <= sensor.most_m)
        return np.where(measures, depth_m, np.float32(0.0))

    def _field(self) -> DepthArray:
        """Return a field (h, w) of standard deviation 1 and the camera's correlation."""
        field = self._generator.standard_normal(self._shape[::-1], dtype=np.float32)
        _correlate(field, self._kept)
        field = np.ascontiguousarray(field.T)
        _correlate(field, self._kept)
        return field

    def _err_at_edges(self, true_m: DepthArray, measured_m: DepthArray) -> None:
        """Mix near and far depth, or leave holes, in `measured_m` where `true_m` jumps within 3 x 3 pixels."""
        sensor = self._sensor
        near_m, far_m = _neighbours(true_m, np.minimum), _neighbours(true_m, np.maximum)
        rows, columns = np.nonzero(far_m - near_m > self._edge * far_m)
        drawn, mix = self._generator.random((2, rows.size), dtype=np.float32)
        hole = drawn < self._level * sensor.edge_hole_share
        mixed = drawn > 1.0 - self._level * sensor.mixed_share
        near_m, far_m = near_m[rows, columns], far_m[rows, columns]
        # Nothing lies between a surface and what is out of reach.
        hole |= mixed & (near_m <= 0.0)
        edge_m = np.where(mixed, near_m + mix * (far_m - near_m), measured_m[rows, columns])
        measured_m[rows, columns] = np.where(hole, np.float32(0.0), edge_m)


def _correlate(field: DepthArray, kept: float) -> None:
    """Let each row of independent ones keep the share `kept` of the row before, at the same standard deviation."""
    if kept > 0.0:
        field[1:] *= np.float32(math.sqrt(1.0 - kept * kept))
        # Rows are long, so this loop is faster than SciPy's filter, along whose axis memory is strided.
        for before, row in itertools.pairwise(field):
            np.add(row, np.float32(kept) * before, out=row)


def _neighbours(depth_m: DepthArray, choose: "np.ufunc") -> npt.NDArray[np.float32]:
    """Return each pixel's least or greatest depth within 3 x 3 pixels."""
    chosen = depth_m
    for axis in (0, 1):
        before = np.moveaxis(chosen, axis, 0)
        after = before.copy()
        choose(after[1:], before[:-1], out=after[1:])
        choose(after[:-1], before[1:], out=after[:-1])
        chosen = np.moveaxis(after, 0, axis)
    return chosen
