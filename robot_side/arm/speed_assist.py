"""Limit of the speed along the triggers by the robot side (`--assist speed`), from the fields that the triggers render.

A strong finger can overcome stiffness. This assist therefore limits the speed u, so that the robot, decelerating at a,
stops within w_8, the onset distance of full strength:

    u τ + u²/2a <= w_8        τ: delay until the arm follows a command
"""

import math
from typing import Final

import msgspec

from common.protocol.messages import MotionCommand, TriggerField
from common.touch_speed import touch_speed_m_s

FOLLOWS_S: Final = 0.03
"""Delay τ in seconds of a usual arm: age of a field, up to 10 ms, plus the drive's lag"""


def fastest_m_s(field: TriggerField, response_s: float = 0.0) -> float:
    """Return the greatest speed along a trigger that stops in time; a target may be touched at the touching speed.

    response_s: `JointLimits.response_s`, which adds to τ.
    """
    follows_s = FOLLOWS_S + response_s
    by_slow = _stops_within_m_s(field.slow_m[-1], field.acceleration_m_s2, follows_s)
    return max(
        min(by_slow, touch_speed_m_s(field.full_speed_m_s)),
        _stops_within_m_s(field.fast_m[-1], field.acceleration_m_s2, follows_s),
    )


def assisted(command: MotionCommand, l2: TriggerField, r2: TriggerField, response_s: float = 0.0) -> MotionCommand:
    """Return `command` with its travel limited by `fastest_m_s`; sticks and buttons are unchanged."""
    travel = command.r2 - command.l2
    field = r2 if travel > 0.0 else l2
    most = fastest_m_s(field, response_s) / field.full_speed_m_s
    if abs(travel) <= most:
        return command
    return msgspec.structs.replace(command, l2=0.0 if travel > 0.0 else most, r2=most if travel > 0.0 else 0.0)


def _stops_within_m_s(distance_m: float, acceleration_m_s2: float, follows_s: float) -> float:
    lost = acceleration_m_s2 * follows_s
    return math.sqrt(lost * lost + 2.0 * acceleration_m_s2 * max(distance_m, 0.0)) - lost
