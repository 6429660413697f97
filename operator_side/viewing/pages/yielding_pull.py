"""Pull of keys, which meet no resistance: it yields to a trigger's zones as a light finger at a trigger would."""

import math
from typing import Final

from operator_side.controller.feel import SENSED_TRAVEL, ZONE_COUNT, Strengths
from operator_side.dualsense.simulated.trigger_model import FINGER_TIME_CONSTANT_S, equilibrium_travel

YIELDING_FINGER_N: Final = 2.0
"""Force of the finger, in newtons: a light pull, which strength 8 stops in any zone"""


class YieldingPull:
    """Pull of one trigger by a key. A free zone lets it pass; a stiff zone stops it where it stops a finger of 2 N."""

    def __init__(self) -> None:
        self.yields = False
        """Whether a stiff zone kept the last pull below the travel that was asked for"""
        self._travel = 0.0

    def travel(self, asked: float, strengths: Strengths, passed_s: float) -> float:
        """Return the raw travel, 0 to 1, `passed_s` after the last call. asked: raw travel that the key asks for."""
        stopped = max(strengths.count(0) / ZONE_COUNT, equilibrium_travel(YIELDING_FINGER_N, strengths)) / SENSED_TRAVEL
        self.yields = stopped < asked
        end = min(asked, stopped)
        approached = end + (self._travel - end) * math.exp(-passed_s / FINGER_TIME_CONSTANT_S)
        self._travel = min(approached, asked)  # a key that comes up pulls no longer
        return self._travel
