"""One move of a person who moves and waits: as smooth as can be, and not corrected on its way."""

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
