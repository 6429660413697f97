"""When a tick looks: at once if what is looked at has changed, else as often as something moves."""

from typing import Final

import numpy as np

from robot_side.laws.gripper_motion import STILL_M_S
from robot_side.laws.looking import Seen

LOOK_PERIOD_S: Final = 0.008
"""Period of looks while something moves: a controller is written to every 10 ms"""
REST_PERIOD_S: Final = 0.05
"""Period of looks while everything rests"""
_SAME_AGE_S: Final = 0.002
"""Change of the loop age up to which looks at rest still count"""
_REST_M: Final = 1e-3
"""Displacement of the tool, and change of the gap between the fingers, up to which looks at rest still count"""
_SAME_STICK: Final = 0.1
"""Change of the stick's deflection up to which looks along it still count"""
_ROUNDING_S: Final = 1e-9


def is_due(seen: Seen, last: Seen, *, waits: bool) -> bool:
    """Return whether a tick looks. last: the last tick that looked. waits: whether the map's looks are incomplete."""
    if seen.passed_s < 0.0 or differs(seen, last):
        return True
    if seen.passed_s + _ROUNDING_S < LOOK_PERIOD_S:
        return False
    return waits or not rests(seen, last) or have_moved(seen, last) or seen.passed_s + _ROUNDING_S >= REST_PERIOD_S


def rests(seen: Seen, last: Seen) -> bool:
    """Return whether the gripper rests where the last looks were made, at about the same loop age."""
    now, then = seen.situation, last.situation
    if seen.motion.moves or abs(now.loop_age_s - then.loop_age_s) > _SAME_AGE_S or now.lateral != then.lateral:
        return False
    moved_m = now.pose.tool_position_m - then.pose.tool_position_m
    return float(moved_m @ moved_m) < _REST_M * _REST_M and abs((now.gap_m or 0.0) - (then.gap_m or 0.0)) < _REST_M


def differs(seen: Seen, last: Seen) -> bool:
    """Return whether what is looked at, and how, differs from the last tick that looked; motion does not count."""
    now, then = seen.situation, last.situation
    sticks = zip(now.lateral, then.lateral, strict=True)
    return (
        (seen.classes is not last.classes and seen.classes.meant != last.classes.meant)
        or seen.assumed is not last.assumed
        or seen.motion.moves != last.motion.moves
        or len(now.pose.sphere_radii_m) != len(then.pose.sphere_radii_m)
        or (now.compensation, now.loop_age_known) != (then.compensation, then.loop_age_known)
        or (now.lateral == (0.0, 0.0)) != (then.lateral == (0.0, 0.0))
        or any(abs(one - other) > _SAME_STICK for one, other in sticks)
        or abs(now.astray_m_s - then.astray_m_s) > STILL_M_S
        or now.later_s != then.later_s
    )


def have_moved(seen: Seen, last: Seen) -> bool:
    """Return whether objects may have moved since the last tick that looked, or move now."""
    objects = seen.situation.objects
    if objects is last.situation.objects:
        return False
    velocities_m_s, since = objects.velocities_m_s, objects.since
    if velocities_m_s is None:
        # Without velocities any object may be elsewhere in each new frame.
        return True
    moving_m_s = velocities_m_s if since is None else velocities_m_s[since[0].things]
    return bool(np.abs(moving_m_s).max(initial=0.0) > STILL_M_S)
