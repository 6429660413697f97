"""Velocities of objects, from their positions in the last frames."""

from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import FLOAT64, INT64, compiled, input_array, output_array

WINDOW_S = 0.2
"""Time in s over which a velocity is measured. The result is late by half of it, and a frame's noise counts little."""


_FRAMES: Final = 8
"""Number of frames for which memory is reserved at first"""


class ObjectVelocities:
    """Slope of each object's positions over WINDOW_S, by least squares."""

    def __init__(self) -> None:
        self._times_s: FloatArray = np.empty(0)
        self._positions_m: FloatArray = np.empty((0, 0))
        self._kept = 0

    def see(self, time_s: float, positions_m: FloatArray) -> FloatArray:
        """Add a frame, no older than the last one. Return the objects' velocities (k, 3) in m/s; 0 for the first frame.

        positions_m (k, 3): position of one point of each object. ValueError for another number of objects than before.
        """
        if self._kept and positions_m.size != self._positions_m.shape[1]:
            raise ValueError(
                f"positions_m holds {len(positions_m)} positions; valid: {self._positions_m.shape[1] // 3}, as before"
            )
        if self._kept == len(self._times_s):
            rows = max(2 * self._kept, _FRAMES)
            seen_m = self._positions_m.reshape(self._kept, positions_m.size)
            self._times_s, self._positions_m = np.resize(self._times_s, rows), np.empty((rows, positions_m.size))
            self._positions_m[: self._kept] = seen_m
        velocities: FloatArray = np.empty(positions_m.shape)
        oldest_s, flat = time_s - WINDOW_S - 1e-9, positions_m.reshape(-1)
        seen = self._times_s, self._positions_m, self._kept
        self._kept = _see(*seen, time_s, oldest_s, flat, velocities.reshape(-1))
        return velocities


@compiled(output_array(1), output_array(2), INT64, FLOAT64, FLOAT64, input_array(1), output_array(1), returns=INT64)
def _see(
    times: FloatArray,
    seen: FloatArray,
    kept: int,
    now: float,
    oldest: float,
    positions: FloatArray,
    velocities: FloatArray,
) -> int:
    """Drop frames that are too old, add positions (3 k,), fill velocities (3 k,); return the number of frames kept."""
    first = 0
    while first < kept and times[first] < oldest:
        first += 1
    for frame in range(first, kept):
        times[frame - first] = times[frame]
        for place in range(positions.size):
            seen[frame - first, place] = seen[frame, place]
    kept -= first
    times[kept] = now
    for place in range(positions.size):
        seen[kept, place] = positions[place]
    kept += 1
    # Times relative to now: a clock's large numbers leave few digits for differences.
    middle, spread = 0.0, 0.0
    for frame in range(kept):
        middle += (times[frame] - now) / kept
    for frame in range(kept):
        away = times[frame] - now - middle
        spread += away * away
    for place in range(positions.size):
        velocities[place] = 0.0
        for frame in range(kept):
            if spread > 0.0:
                velocities[place] += (times[frame] - now - middle) / spread * seen[frame, place]
    return kept
