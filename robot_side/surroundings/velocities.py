"""Velocities of objects, from their positions in the last frames."""

from collections import deque

import numpy as np

from common.arrays import FloatArray

WINDOW_S = 0.2
"""Time in s over which a velocity is measured. The result is late by half of it, and a frame's noise counts little."""


class ObjectVelocities:
    """Slope of each object's positions over WINDOW_S, by least squares."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, FloatArray]] = deque()
        """Time and positions of each frame"""

    def see(self, time_s: float, positions_m: FloatArray) -> FloatArray:
        """Add a frame, no older than the last one. Return the objects' velocities (k, 3) in m/s; 0 for the first frame.

        positions_m (k, 3): position of one point of each object. ValueError for another number of objects than before.
        """
        seen = self._seen
        if seen and positions_m.shape != seen[-1][1].shape:
            raise ValueError(f"positions_m holds {len(positions_m)} positions; valid: {len(seen[-1][1])}, as before")
        while seen and seen[0][0] < time_s - WINDOW_S - 1e-9:
            seen.popleft()
        seen.append((time_s, positions_m.copy()))
        # Times relative to now: a clock's large numbers leave few digits for differences.
        ages_s = np.array([at_s - time_s for at_s, _ in seen])
        away_s = ages_s - ages_s.mean()
        spread_s2 = float(away_s @ away_s)
        velocities_m_s: FloatArray = np.zeros(positions_m.shape)
        for share, (_, at_m) in zip(away_s / spread_s2, seen, strict=True) if spread_s2 > 0.0 else ():
            velocities_m_s += share * at_m
        return velocities_m_s
