"""What the scripted person concludes from the screen over time: a target comes no nearer, an object sinks no more."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from common.protocol.messages import Telemetry

_NO_FURTHER_S: Final = 2.5
"""Seconds without progress after which a target counts as coming no nearer"""
_PROGRESS_M: Final = 0.003
"""Smallest motion that the person sees, in metres"""
_STANDS_S: Final = 0.5
"""Seconds over which an object's sinking is judged"""


@dataclass(frozen=True)
class Glance:
    """What the person sees and knows at one time; input of each phase's decisions."""

    now_s: float
    view: Telemetry
    gain: float
    """Gain, in 1/s: commanded speed for each metre of a seen error"""
    lag_s: float
    """Time, in seconds, that the person expects from a motion of the hand until they see its outcome"""


class StalledApproach:
    """Detects that a target has come no nearer for some time, so that the person takes it as reached."""

    def __init__(self, now_s: float) -> None:
        self._nearest_m, self._nearer_s = math.inf, now_s

    def see(self, distance_m: float, glance: Glance) -> bool:
        """Take the distance that seems left; return whether the target has come no nearer for some time."""
        if distance_m < self._nearest_m - _PROGRESS_M:
            self._nearest_m, self._nearer_s = distance_m, glance.now_s
        return glance.now_s - self._nearer_s > _NO_FURTHER_S + glance.lag_s


class StalledDescent:
    """Detects that an object that was sinking does not sink any more, so that it stands."""

    def __init__(self, now_s: float) -> None:
        self._began_s = now_s
        self._heights: deque[tuple[float, float]] = deque()
        self._sank = False
        self._pressed_s = -math.inf

    def presses(self, now_s: float) -> None:
        """Note that the hand presses harder from now on, so that only what is seen of its outcome counts."""
        self._pressed_s = now_s

    def see(self, height_m: float, slowest_m_s: float, glance: Glance) -> bool:
        """Take the height; return whether the object stands. A moving object sinks at `slowest_m_s` or faster."""
        self._heights.append((glance.now_s, height_m))
        while self._heights[0][0] < glance.now_s - _STANDS_S:
            self._heights.popleft()
        share = (self._heights[0][1] - height_m) / (slowest_m_s * _STANDS_S)
        # A slight sinking before lowering does not count; an object that never sinks is stopped, too.
        self._sank |= share > 0.5 or glance.now_s - self._began_s > _NO_FURTHER_S + glance.lag_s
        return self._sank and share < 0.2 and glance.now_s - self._pressed_s > _STANDS_S + glance.lag_s
