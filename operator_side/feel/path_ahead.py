"""Trace the gripper's path, trigger and sticks together, through the robot side's map of what is around it.

The robot side knows a stick a loop after the hand does. So it sends ways from probes around the gripper (`Around`).
The path begins where that message was sent. It follows the commands under way. Then the sticks stay as they are, for
one reaction and until the arm stands. A zone is full where its path is longer, at some point, than the way that is free
there.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.following import follow
from common.protocol.around import ACROSS, DIRECTIONS, TURNED, Around
from common.protocol.messages import TriggerField
from common.touch_speed import touch_speed_m_s
from operator_side.feel.commands_under_way import Course, Sticks

_UNDER_WAY: Final = 9
"""The most points of a path by the commands under way,"""
_AHEAD: Final = 8
"""and the points beyond."""
_ALIKE: Final = 0.1
"""Share of the distance between two probes: both count within it of the middle."""
_ACROSS, _TURNED = slice(0, 2), slice(2, 4)


class Aside(NamedTuple):
    """A map, and the gripper's course in it."""

    around: Around
    horizon_m: float
    """That of the message with it"""
    course: Course
    """Along the direction in which R2 advances, from the message with `around` to now"""
    sticks: Sticks
    """Deflections, as commanded now"""

    def ways_m(self, *, advancing: bool) -> tuple[FloatArray, FloatArray]:
        """Take the ways (PROBES,) of one trigger, fast and slow."""
        r2, r2_slow, l2, l2_slow = self.around.ways_m(self.horizon_m)
        return (r2, r2_slow) if advancing else (l2, l2_slow)


def first_full_zone(
    aside: Aside, field: TriggerField, travels: Sequence[float], other_travel: float, horizon_s: float, *, forth: bool
) -> int:
    """Find the first zone whose path meets something, as many as there are zones for none.

    travels: at the middle of each zone. forth: the trigger advances.
    """
    course = aside.course if forth else aside.course.turned_back()
    some = np.unique(np.linspace(0, len(course.ways_m) - 1, _UNDER_WAY).astype(np.int64))
    under_way_m, under_way_s = np.array(course.ways_m)[some], course.aside_s[some]
    speeds_m_s = [(travel - other_travel) * field.full_speed_m_s for travel in travels]
    first = next((zone for zone, speed_m_s in enumerate(speeds_m_s) if speed_m_s > 0.0), len(travels))
    if first == len(travels):
        return first
    touch_m_s = touch_speed_m_s(field.full_speed_m_s)
    after_s = np.array([_after_s(field, speed_m_s, horizon_s) for speed_m_s in speeds_m_s[first:]])
    ahead_s = under_way_s[-1] + after_s[..., None] * np.array(aside.sticks)
    points = np.concatenate([under_way_s, ahead_s.reshape(-1, 4)]) / aside.around.full_s
    fast_m, slow_m = (free_ways_m(ways_m, points) for ways_m in aside.ways_m(advancing=forth))
    count = len(some)
    for place, speed_m_s in enumerate(speeds_m_s[first:]):
        free_m = slow_m if place == 0 or speed_m_s < touch_m_s else fast_m
        mine = np.concatenate([free_m[:count], free_m[count + place * _AHEAD : count + (place + 1) * _AHEAD]])
        ahead_m = _ways_m(course, field, speed_m_s, horizon_s, after_s[place].tolist())
        # A point counts with those before and after it.
        if (np.concatenate([under_way_m[1:], ahead_m]) >= np.minimum(mine[:-1], mine[1:])).any():
            return first + place
    return len(travels)


def _after_s(field: TriggerField, speed_m_s: float, horizon_s: float) -> FloatArray:
    """Spread the points (_AHEAD,) of a path over the time until an arm of this speed stands."""
    return np.linspace(0.0, horizon_s + speed_m_s / field.acceleration_m_s2, _AHEAD + 1)[1:]


def _ways_m(
    course: Course, field: TriggerField, speed_m_s: float, horizon_s: float, after_s: list[float]
) -> list[float]:
    """Work out how far the gripper is at these times, at a zone's speed for one reaction and braking then."""
    here = course.ways_m[-1], course.speed_m_s
    there = follow(*here, speed_m_s, field.acceleration_m_s2, horizon_s)
    return [
        follow(*here, speed_m_s, field.acceleration_m_s2, after)[0]
        if after <= horizon_s
        else follow(*there, 0.0, field.acceleration_m_s2, after - horizon_s)[0]
        for after in after_s
    ]


def free_ways_m(ways_m: FloatArray, aside: FloatArray) -> FloatArray:
    """Interpolate the ways (PROBES,) at points (k, 4), of a fully deflected stick's course: right, up, and turned so.

    The shorter of those across and turned. Across, a thing begins at once: the nearest probe counts. In a turn a wall
    comes nearer steadily: linear in the angle. Beyond the farthest probe its way holds.
    """
    here_m, sides_m = np.full((DIRECTIONS, 1), ways_m[0]), ways_m[1:].reshape(DIRECTIONS, ACROSS + TURNED)
    across_m, turned_m = (np.hstack([here_m, part]) for part in (sides_m[:, :ACROSS], sides_m[:, ACROSS:]))
    return np.minimum(
        _between(across_m, aside[:, _ACROSS], linear=False), _between(turned_m, aside[:, _TURNED], linear=True)
    )


def _between(ways_m: FloatArray, aside: FloatArray, *, linear: bool) -> FloatArray:
    """Interpolate ways (DIRECTIONS, r + 1), evenly from 0 to 1, at points (k, 2): outwards, then between two sides.

    linear: outwards; else the nearest way, and the shorter of two about as near.
    """
    size = np.abs(aside).sum(axis=1)
    share = np.abs(aside[:, 0]) / np.where(size > 0.0, size, 1.0)
    ring = np.minimum(np.hypot(aside[:, 0], aside[:, 1]), 1.0) * (ways_m.shape[1] - 1)
    inner: IntArray = np.minimum(ring.astype(np.int64), ways_m.shape[1] - 2)
    part, found = ring - inner, np.zeros(len(aside))
    for axis, weight in ((0, share), (1, 1.0 - share)):
        side = np.where(aside[:, axis] >= 0.0, axis, axis + 2)
        one, other = ways_m[side, inner], ways_m[side, inner + 1]
        if linear:
            mine = (1.0 - part) * one + part * other
        else:
            nearest = np.where(part < 0.5 + _ALIKE, one, other), np.where(part > 0.5 - _ALIKE, other, one)
            mine = np.minimum(*nearest)
        found += weight * mine
    return found
