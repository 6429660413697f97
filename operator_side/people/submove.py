"""A person who moves and waits: each move as smooth as can be, and not corrected on its way."""

import math
from dataclasses import dataclass
from typing import Final

from common.protocol.messages import Vector3

_LEAST_S: Final = 0.4
_PEAK: Final = 1.875
"""The greatest speed of a minimum-jerk move over its mean."""


@dataclass(frozen=True)
class Submove:
    """A minimum-jerk move by `by_m` in the tool frame: v(s) = 30 s²(1 - s)² / T, s = t / T (Flash and Hogan 1985)."""

    began_s: float
    by_m: Vector3
    duration_s: float

    @classmethod
    def plan(cls, now_s: float, by_m: Vector3, across_m_s: float, along_m_s: float) -> "Submove":
        """The quickest one from `now_s` that is nowhere faster than `across_m_s` (x, y) and `along_m_s` (z)."""
        x, y, z = by_m
        return cls(now_s, by_m, max(_LEAST_S, _PEAK * max(math.hypot(x, y) / across_m_s, abs(z) / along_m_s)))

    def velocity_m_s(self, now_s: float) -> Vector3:
        """In the tool frame; 0 before and after."""
        part = min(max((now_s - self.began_s) / self.duration_s, 0.0), 1.0)
        shape = 30.0 * part**2 * (1.0 - part) ** 2 / self.duration_s
        x, y, z = self.by_m
        return (shape * x, shape * y, shape * z)

    def over(self, now_s: float) -> bool:
        """Whether it has ended by `now_s`."""
        return now_s >= self.began_s + self.duration_s


class MoveAndWait:
    """Moves one after the other; each is planned only once the outcome of the last one can be seen."""

    def __init__(self) -> None:
        self._move: Submove | None = None
        self._paused_s = -math.inf

    def forget(self) -> None:
        """Begin anew, with nothing to wait for."""
        self._move, self._paused_s = None, -math.inf

    def break_off(self, now_s: float) -> None:
        """End the present move, and see first what came of it."""
        self._move, self._paused_s = None, now_s

    def free(self, now_s: float, lag_s: float) -> bool:
        """Whether no move is going on, and the last one's outcome is seen, `lag_s` after its end."""
        if self._move is not None and self._move.over(now_s):
            self.break_off(now_s)
        return self._move is None and now_s - self._paused_s > lag_s

    def velocity_m_s(self, now_s: float) -> Vector3:
        """Of the present move, in the tool frame."""
        return (0.0, 0.0, 0.0) if self._move is None else self._move.velocity_m_s(now_s)

    def begin(self, now_s: float, by_m: Vector3, across_m_s: float, along_m_s: float) -> None:
        """The next move: see `Submove.plan`."""
        self._move = Submove.plan(now_s, by_m, across_m_s, along_m_s)
