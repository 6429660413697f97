"""How fast objects move, from where they were seen in the last frames."""

from collections import deque

import numpy as np

from common.arrays import FloatArray

WINDOW_S = 0.2
"""Over so long a time a velocity is measured: a tenth of a second late, and a frame's noise counts little."""


class ObjectVelocities:
    """The slope of each object's positions over the window, by least squares."""

    def __init__(self, window_s: float = WINDOW_S) -> None:
        """ValueError unless the window is above 0."""
        if not window_s > 0.0:
            raise ValueError(f"window_s = {window_s}; valid: above 0")
        self._window_s = window_s
        self._seen: deque[tuple[float, FloatArray]] = deque()

    def see(self, time_s: float, positions_m: FloatArray) -> FloatArray:
        """Take in a frame, no older than the last one; velocities (k, 3) in m/s of the k objects, 0 in the first.

        positions_m (k, 3): of one point of each object.
        """
        self._seen.append((time_s, positions_m))
        while self._seen[0][0] < time_s - self._window_s - 1e-9:
            self._seen.popleft()
        times = np.array([when for when, _ in self._seen])
        times -= times.mean()
        spread = float(times @ times)
        if spread == 0.0:
            return np.zeros_like(positions_m)
        velocities: FloatArray = np.tensordot(times, np.array([where for _, where in self._seen]), axes=1) / spread
        return velocities
