"""Moves of a person who moves and waits; each move has minimum jerk and is not corrected while it lasts."""

import math
from typing import Final

from common.protocol.messages import Vector3

_LEAST_S: Final = 0.4
"""Minimum duration of a move, in seconds"""
_PEAK: Final = 1.875
"""Ratio of a minimum-jerk move's maximum speed to its mean speed"""


class MoveAndWait:
    """One move after another; each begins only once the outcome of the move before it can be seen.

    Speed of a move of duration T, as a share of its distance: v = 30 s²(1 - s)² / T, s = t / T (minimum jerk; Flash
    and Hogan 1985).
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Reset, so that there is no move and no outcome to wait for."""
        self._move: tuple[float, float, Vector3] | None = None
        """Begin, duration, and displacement in the tool's frame; None without a move"""
        self._paused_s = -math.inf

    def break_off(self, now_s: float) -> None:
        """End the present move at `now_s`, and wait for its outcome."""
        self._move, self._paused_s = None, now_s

    def free(self, now_s: float, lag_s: float) -> bool:
        """Return whether the next move may begin: `lag_s` after the end of the last one, when its outcome is seen."""
        if self._move is not None and now_s >= self._move[0] + self._move[1]:
            self.break_off(now_s)
        return self._move is None and now_s - self._paused_s > lag_s

    def velocity_m_s(self, now_s: float) -> Vector3:
        """Return the velocity of the present move, in the tool's frame."""
        if self._move is None:
            return (0.0, 0.0, 0.0)
        began_s, lasts_s, (x, y, z) = self._move
        part = min(max((now_s - began_s) / lasts_s, 0.0), 1.0)
        shape = 30.0 * part**2 * (1.0 - part) ** 2 / lasts_s
        return (shape * x, shape * y, shape * z)

    def begin(self, now_s: float, by_m: Vector3, across_m_s: float, along_m_s: float) -> None:
        """Begin the quickest move by `by_m`, with speeds up to `across_m_s` in x, y and `along_m_s` in z."""
        x, y, z = by_m
        lasts_s = max(_LEAST_S, _PEAK * max(math.hypot(x, y) / across_m_s, abs(z) / along_m_s))
        self._move = now_s, lasts_s, by_m
