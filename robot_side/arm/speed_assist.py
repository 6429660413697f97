"""`--assist speed`: the robot side caps the speed along the triggers itself, from the field that the fingers feel.

Stiffness is advice, which a strong finger overcomes. Where the robot may act, too, it goes no faster than what lets it
stop at the way of full strength, w_8:

    u τ + u²/2a <= w_8        τ: until the arm follows what it is told
"""

import math
from typing import Final

import msgspec

from common.protocol.messages import MotionCommand, TriggerField
from common.touch_speed import touch_speed_m_s

FOLLOWS_S: Final = 0.03
"""τ: a field is up to 10 ms old, and a drive takes about as long again."""


def fastest_m_s(field: TriggerField) -> float:
    """The greatest speed along a trigger that still stops in time; what is to be touched may be, at touching speed."""
    by_slow = _stops_within_m_s(field.slow_m[-1], field.acceleration_m_s2)
    return max(
        min(by_slow, touch_speed_m_s(field.full_speed_m_s)),
        _stops_within_m_s(field.fast_m[-1], field.acceleration_m_s2),
    )


def assisted(command: MotionCommand, l2: TriggerField, r2: TriggerField) -> MotionCommand:
    """`command` with no more travel than that; sticks and buttons are left alone."""
    travel = command.r2 - command.l2
    field = r2 if travel > 0.0 else l2
    most = fastest_m_s(field) / field.full_speed_m_s
    if abs(travel) <= most:
        return command
    return msgspec.structs.replace(command, l2=0.0 if travel > 0.0 else most, r2=most if travel > 0.0 else 0.0)


def _stops_within_m_s(way_m: float, acceleration_m_s2: float) -> float:
    lost = acceleration_m_s2 * FOLLOWS_S
    return math.sqrt(lost * lost + 2.0 * acceleration_m_s2 * max(way_m, 0.0)) - lost
