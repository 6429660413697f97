"""What the eye makes of the screen over time: what comes no nearer, and what sinks no more."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from common.protocol.messages import Telemetry

_NO_FURTHER_S: Final = 2.5
_PROGRESS_M: Final = 0.003
"""Less than this is no motion to the eye."""
_STANDS_S: Final = 0.5


@dataclass(frozen=True)
class Glance:
    """What a phase decides on."""

    now_s: float
    view: Telemetry
    gain: float
    """How fast to correct a seen error, in 1/s."""
    lag_s: float
    """How long after a motion of the hand its outcome is seen, as far as they reckon with it."""


class NoNearer:
    """Whether the target has come no nearer for long, whatever they did: they take it for as near as it gets."""

    def __init__(self, now_s: float) -> None:
        self._nearest_m, self._nearer_s = math.inf, now_s

    def see(self, way_m: float, look: Glance) -> bool:
        """Take in the way that seems left."""
        if way_m < self._nearest_m - _PROGRESS_M:
            self._nearest_m, self._nearer_s = way_m, look.now_s
        return look.now_s - self._nearer_s > _NO_FURTHER_S + look.lag_s


class SinksNoMore:
    """Whether something had begun to sink, and has not for a moment now."""

    def __init__(self) -> None:
        self._heights: deque[tuple[float, float]] = deque()
        self._sank = False

    def see(self, height_m: float, slowest_m_s: float, look: Glance) -> bool:
        """Take in the height; nothing sinks more slowly than at `slowest_m_s` before it stands."""
        self._heights.append((look.now_s, height_m))
        while self._heights[0][0] < look.now_s - _STANDS_S:
            self._heights.popleft()
        share = (self._heights[0][1] - height_m) / (slowest_m_s * _STANDS_S)
        # What sags a little before it is lowered has not begun to.
        self._sank |= share > 0.5
        return self._sank and share < 0.2
