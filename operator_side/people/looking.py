"""Judgement of the screen over time: a target that comes no nearer, an object that sinks no more."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from common.protocol.messages import Telemetry

_NO_FURTHER_S: Final = 2.5
_PROGRESS_M: Final = 0.003
"""Least motion that the eye sees, in metres."""
_STANDS_S: Final = 0.5


@dataclass(frozen=True)
class Glance:
    """Input of a phase's decisions."""

    now_s: float
    view: Telemetry
    gain: float
    """Gain of the correction of a seen error, in 1/s"""
    lag_s: float
    """Time from a motion of the hand to its seen outcome, as far as the person expects it"""


class StalledApproach:
    """Detector of a target that has come no nearer for long, which the person takes for as near as it gets."""

    def __init__(self, now_s: float) -> None:
        self._nearest_m, self._nearer_s = math.inf, now_s

    def see(self, distance_m: float, look: Glance) -> bool:
        """Take in the distance that seems left; return the judgement."""
        if distance_m < self._nearest_m - _PROGRESS_M:
            self._nearest_m, self._nearer_s = distance_m, look.now_s
        return look.now_s - self._nearer_s > _NO_FURTHER_S + look.lag_s


class StalledDescent:
    """Detector of an object that had begun to sink, and has not sunk for a moment."""

    def __init__(self) -> None:
        self._heights: deque[tuple[float, float]] = deque()
        self._sank = False

    def see(self, height_m: float, slowest_m_s: float, look: Glance) -> bool:
        """Take in the height; return the judgement. An object sinks at `slowest_m_s` or faster until it stands."""
        self._heights.append((look.now_s, height_m))
        while self._heights[0][0] < look.now_s - _STANDS_S:
            self._heights.popleft()
        share = (self._heights[0][1] - height_m) / (slowest_m_s * _STANDS_S)
        # A small sag before lowering does not count.
        self._sank |= share > 0.5
        return self._sank and share < 0.2
