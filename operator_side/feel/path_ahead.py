"""Trace the gripper's path, trigger and sticks together, through the robot side's map of its surroundings.

The robot side receives a stick's deflection late. So it sends a map (`Around`): contact distances from probes, which
are positions around the gripper. The path begins at the gripper's position when the map was sent. It follows the
commands under way, then the zone's speed for one reaction, then brakes: once with the sticks as they are, once with
them released. A zone has full strength if either path exceeds the contact distance at some point.
"""

from bisect import bisect_right
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.around import ACROSS, DIRECTIONS, TURNED, Around
from common.protocol.messages import TriggerField
from common.touch_speed import touch_speed_m_s
from operator_side.controller.feel import MAX_STRENGTH
from operator_side.feel.commands_under_way import AT_REST, Course, Sticks
from operator_side.feel.zones import FREE, Zones

_UNDER_WAY: Final = 9
"""Maximum number of points of the path that is due to the commands under way"""
_AHEAD: Final = 8
"""Number of points of the path during reaction and braking"""
_LEAST_S: Final = 1e-9
_ALIKE: Final = 0.1
"""Half width of the band midway between two probes in which both count, as a share of the probes' distance"""
_ALONE: Final = 0.15
"""Share of one axis in a displacement across, below which only the other axis counts"""
_RISES_M: Final = 0.01
"""Distance before full strength within which weaker strengths apply; farther away they are of another object"""
_LEFT_OUT: Final = 0.02
"""Share of the outermost probe's displacement up to which a move across or a turn is ignored"""
_ACROSS, _TURNED = slice(0, 2), slice(2, 4)


class CourseOnMap(NamedTuple):
    """Map of contact distances, and the gripper's course on it."""

    around: Around
    horizon_m: float
    """Horizon in the message that brought the map"""
    course: Course
    """Course by the commands under way since the map was sent, along the direction in which R2 moves the gripper"""
    sticks: Sticks
    """Deflections that are commanded now"""

    def onsets_m(self, *, advancing: bool) -> FloatArray:
        """Return one trigger's contact distances (2, PROBES): a row for fast zones and a row for slow ones.

        advancing: for the trigger that moves the gripper forward.
        """
        return self.around.onsets_m(self.horizon_m)[slice(0, 2) if advancing else slice(2, 4)]


def traced_zones(
    aside: CourseOnMap,
    field: TriggerField,
    travels: Sequence[float],
    other_travel: float,
    horizon_s: float,
    *,
    forth: bool,
) -> Zones:
    """Compute the strengths of the zones: full where a zone's path meets something.

    Within 10 mm before that, strengths rise as the onset distances of `field` do. Each zone has two paths: with the
    sticks as they are, and with the sticks released now; the stiffer result counts. travels: calibrated travel at the
    middle of each zone. forth: whether this trigger moves the gripper forward.
    """
    where = field, travels, other_travel, horizon_s
    goes_on = _traced(aside, *where, forth=forth)
    if aside.sticks == AT_REST:
        return goes_on
    return goes_on.at_least(_traced(aside._replace(sticks=AT_REST), *where, forth=forth), MAX_STRENGTH)


def _traced(
    aside: CourseOnMap,
    field: TriggerField,
    travels: Sequence[float],
    other_travel: float,
    horizon_s: float,
    *,
    forth: bool,
) -> Zones:
    course = aside.course if forth else aside.course.turned_back()
    full_m_s = field.full_speed_m_s
    speeds_m_s = (np.array(travels) - other_travel) * full_m_s
    first = int(np.searchsorted(speeds_m_s, 0.0, side="right"))
    if first == len(travels):
        return FREE
    # In order, so that np.unique is not needed: its first call loads a part of NumPy, which takes longer than a turn.
    some = np.linspace(0, len(course.displacements_m) - 1, _UNDER_WAY).astype(np.int64)
    some = some[np.diff(some, prepend=-1) > 0]
    speeds_m_s, here_s = speeds_m_s[first:, None], course.aside_s[some]
    ahead_m, ahead_s = _ahead(course, speeds_m_s, aside.sticks, full_m_s, horizon_s)
    points = np.concatenate([here_s, ahead_s.reshape(-1, 4)]) / aside.around.full_s
    free_m = contact_distances_m(aside.onsets_m(advancing=forth), points)
    # From here on one row for each zone: displacement along its path, and the contact distances there.
    slow = speeds_m_s < touch_speed_m_s(full_m_s)
    slow[0] = True
    count, zones = len(some), len(speeds_m_s)
    under_way_m = np.where(slow, free_m[1, :count], free_m[0, :count])
    then_m = np.where(slow, free_m[1, count:].reshape(zones, -1), free_m[0, count:].reshape(zones, -1))
    free_m = np.hstack([under_way_m, then_m])
    known_m = np.broadcast_to(course.displacements_m[some[1:]], (zones, count - 1))
    path_m = np.hstack([known_m, ahead_m])
    # Between two points the shorter contact distance counts.
    short_m = (path_m - np.minimum(free_m[:, :-1], free_m[:, 1:])).max(axis=1).tolist()
    found = [0] * first
    for of_slow, beyond_m in zip(slow[:, 0].tolist(), short_m, strict=True):
        onsets = field.slow_m if of_slow else field.fast_m
        weaker = bisect_right(onsets, onsets[-1] + beyond_m) if beyond_m > -_RISES_M else 0
        strength = MAX_STRENGTH if beyond_m >= 0.0 else weaker
        found.append(max(found[-1] if found else 0, strength))
    return Zones(tuple(found), int((path_m[:, -1] > aside.horizon_m).sum())) if any(found) else FREE


def _ahead(
    course: Course, speeds_m_s: FloatArray, sticks: Sticks, full_m_s: float, horizon_s: float
) -> tuple[FloatArray, FloatArray]:
    """Continue from the course's end at each zone's speed (z, 1) for one reaction, then brake; `sticks` stay.

    Return, at k = _AHEAD times until standstill, the displacements (z, k) and the displacements by the sticks' axes
    (z, k, 4), as in Course. Gives the same as two calls of `common.following.follow_together`.
    """
    followed = np.array([course.speed_m_s / full_m_s, *course.followed])
    targets = np.hstack([speeds_m_s / full_m_s, np.tile(sticks, (len(speeds_m_s), 1))])
    change = targets - followed
    changing_s = np.abs(change @ course.changes_s.T).max(axis=1, keepdims=True)
    then = followed + change * np.minimum(horizon_s / np.maximum(changing_s, _LEAST_S), 1.0)
    braking = np.hstack([np.zeros_like(speeds_m_s), targets[:, 1:]]) - then
    braking_s = np.abs(braking @ course.changes_s.T).max(axis=1, keepdims=True)
    after_s = np.arange(1, _AHEAD + 1) / _AHEAD * (horizon_s + braking_s)
    going_s, since_s = np.minimum(after_s, horizon_s), np.maximum(after_s - horizon_s, 0.0)
    passed = followed * going_s[..., None] + change[:, None] * _counts_s(going_s, changing_s)[..., None]
    passed += then[:, None] * since_s[..., None] + braking[:, None] * _counts_s(since_s, braking_s)[..., None]
    return course.displacements_m[-1] + full_m_s * passed[..., 0], course.aside_s[-1] + passed[..., 1:]


def _counts_s(after_s: FloatArray, changing_s: FloatArray) -> FloatArray:
    """Integrate, from 0 to `after_s`, a share that grows linearly from 0 to 1 within `changing_s` and stays at 1."""
    growing_s = np.minimum(after_s, changing_s)
    return after_s - growing_s + 0.5 * growing_s**2 / np.maximum(changing_s, _LEAST_S)


def contact_distances_m(onsets_m: FloatArray, aside: FloatArray) -> FloatArray:
    """Interpolate contact distances (n, PROBES) at points `aside` (k, 4) of the map; return (n, k).

    A point has the displacements across (right, up) and turned (right, up), each as a share of the outermost probe's.
    Across, the nearest probe counts, as objects begin abruptly. Turned, interpolation is linear, as walls approach
    steadily. The shorter of the two distances counts. Beyond the outermost probe, distances are constant.
    """
    sides_m = onsets_m[:, 1:].reshape(-1, DIRECTIONS, ACROSS + TURNED)
    here_m = np.broadcast_to(onsets_m[:, :1, None], (len(onsets_m), DIRECTIONS, 1))
    across_m, turned_m = (np.dstack([here_m, part]) for part in (sides_m[..., :ACROSS], sides_m[..., ACROSS:]))
    moves, turns = (np.abs(aside[:, part]).max(axis=1) > _LEFT_OUT for part in (_ACROSS, _TURNED))
    across_m = _between(across_m, aside[:, _ACROSS], linear=False)
    turned_m = _between(turned_m, aside[:, _TURNED], linear=True)
    return np.where(turns & ~moves, turned_m, np.where(turns, np.minimum(across_m, turned_m), across_m))


def _between(onsets_m: FloatArray, aside: FloatArray, *, linear: bool) -> FloatArray:
    """Interpolate contact distances (n, DIRECTIONS, r + 1) at points `aside` (k, 2), first by radius, then by angle.

    linear: interpolate linearly. Otherwise the nearest probe counts; of two that are about equally near, the shorter
    distance.
    """
    size = np.abs(aside).sum(axis=1)
    share = np.abs(aside[:, 0]) / np.where(size > 0.0, size, 1.0)
    ring = np.minimum(np.hypot(aside[:, 0], aside[:, 1]), 1.0) * (onsets_m.shape[2] - 1)
    inner: IntArray = np.minimum(ring.astype(np.int64), onsets_m.shape[2] - 2)
    part, found = ring - inner, []
    for axis in range(2):
        side = np.where(aside[:, axis] >= 0.0, axis, axis + 2)
        one, other = onsets_m[:, side, inner], onsets_m[:, side, inner + 1]
        nearest = np.where(part < 0.5 + _ALIKE, one, other), np.where(part > 0.5 - _ALIKE, other, one)
        found.append((1.0 - part) * one + part * other if linear else np.minimum(*nearest))
    if linear:
        between: FloatArray = share * found[0] + (1.0 - share) * found[1]
        return between
    return np.where(share < _ALONE, found[1], np.where(share > 1.0 - _ALONE, found[0], np.minimum(*found)))
