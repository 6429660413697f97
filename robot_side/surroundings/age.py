"""What is known, and what is not, of the objects' motion since the picture of their frame was taken."""

import math
from typing import Final, NamedTuple

MOST_CARRIED_S: Final = 0.5
"""Longest time for which an object is carried on by its velocity"""
MOST_GROWN_S: Final = 5.0
"""Age from which on what is not known of an object's motion grows no more"""
_CARRIED_PERIOD_S: Final = 0.008
"""Period in which moving objects are carried on"""
_STEP_M: Final = 0.0005
"""Steps in which the distance that objects may have moved unseen is rounded up"""


class Since(NamedTuple):
    """What is known of the motion since a frame's picture was taken."""

    carried_s: float
    """Time for which moving objects are carried on"""
    late_s: float
    """Time by which they may be ahead of or behind that"""
    unseen_m: float
    """Distance by which any object may have moved in a way that the sender has not seen"""

    def is_later(self, than: "Since") -> bool:
        """Return whether moving objects have to be carried on: looks are made no more often."""
        return abs(self.carried_s + self.late_s - than.carried_s - than.late_s) >= _CARRIED_PERIOD_S


STILL: Final = Since(0.0, 0.0, 0.0)
"""Of a picture that was taken now"""


def since(taken_s: tuple[float, float], now_s: float, unseen_m_s: float) -> Since:
    """Return what is known at `now_s` of the motion since a picture, taken between the two times `taken_s`."""
    earliest_s, latest_s = taken_s
    least_s, most_s = max(now_s - latest_s, 0.0), max(now_s - earliest_s, 0.0)
    carried_s = min(0.5 * (least_s + most_s), MOST_CARRIED_S)
    late_s = min(max(most_s - carried_s, carried_s - least_s), MOST_GROWN_S)
    steps = math.ceil(unseen_m_s * min(most_s, MOST_GROWN_S) / _STEP_M - 1e-9)
    return Since(carried_s, late_s, _STEP_M * steps)
