"""Moves of a person who moves and waits: each is as smooth as possible, and not corrected on its way."""

import math
from typing import Final

from common.protocol.messages import Vector3

_LEAST_S: Final = 0.4
_PEAK: Final = 1.875
"""Ratio of a minimum-jerk move's greatest speed to its mean"""


class MoveAndWait:
    """Moves in turn; each is planned only once the outcome of the last one can be seen.

    A move is by minimum jerk: v(s) = 30 s²(1 - s)² / T, s = t / T (Flash and Hogan 1985).
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Reset: no move, and nothing to wait for."""
        self._move: tuple[float, float, Vector3] | None = None
        """Begin, duration, and displacement in the tool frame"""
        self._paused_s = -math.inf

    def break_off(self, now_s: float) -> None:
        """End the present move, and wait for its outcome."""
        self._move, self._paused_s = None, now_s

    def free(self, now_s: float, lag_s: float) -> bool:
        """Return whether no move is in progress and the last one's outcome is seen, `lag_s` after its end."""
        if self._move is not None and now_s >= self._move[0] + self._move[1]:
            self.break_off(now_s)
        return self._move is None and now_s - self._paused_s > lag_s

    def velocity_m_s(self, now_s: float) -> Vector3:
        """Return the velocity of the present move, in the tool frame."""
        if self._move is None:
            return (0.0, 0.0, 0.0)
        began_s, lasts_s, (x, y, z) = self._move
        part = min(max((now_s - began_s) / lasts_s, 0.0), 1.0)
        shape = 30.0 * part**2 * (1.0 - part) ** 2 / lasts_s
        return (shape * x, shape * y, shape * z)

    def begin(self, now_s: float, by_m: Vector3, across_m_s: float, along_m_s: float) -> None:
        """Begin the quickest move within `across_m_s` (x, y) and `along_m_s` (z)."""
        x, y, z = by_m
        lasts_s = max(_LEAST_S, _PEAK * max(math.hypot(x, y) / across_m_s, abs(z) / along_m_s))
        self._move = now_s, lasts_s, by_m
