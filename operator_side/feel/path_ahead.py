"""Trace the gripper's path, trigger and sticks together, through the robot side's map of its surroundings.

The robot side receives a stick's deflection late. So it sends a map (`Around`): contact distances from probes, which
are positions around the gripper. The path begins at the gripper's position when the map was sent. It follows the
commands under way, then the zone's speed for one reaction, then brakes: once with the sticks as they are, once with
them released. A zone has full strength if either path exceeds the contact distance at some point.
"""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.protocol.around import ACROSS, DIRECTIONS, TURNED, Around
from common.protocol.messages import TriggerField
from common.touch_speed import touch_speed_m_s
from operator_side.controller.feel import MAX_STRENGTH, Strengths
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


class Asked(NamedTuple):
    """One trigger, for `traced_zones`."""

    field: TriggerField
    travels: Sequence[float]
    """Calibrated travel at the middle of each zone"""
    other_travel: float
    """Calibrated travel of the other trigger"""
    forth: bool
    """Whether this trigger moves the gripper forward"""


class _Part(NamedTuple):
    """Rows of one trigger's zones that command a motion, all with the same sticks."""

    asked: int
    """Index of the trigger"""
    first: int
    """First of these zones"""
    rows: slice


def traced_zones(aside: CourseOnMap, asked: Sequence[Asked], horizon_s: float) -> list[Zones]:
    """Compute the strengths of each trigger's zones: full where a zone's path meets something.

    Within 10 mm before that, strengths rise as the onset distances of the field do. Each zone has two paths: with the
    sticks as they are, and with the sticks released now; the stiffer result counts. All paths are computed together,
    as most of the time is spent in calls of NumPy.
    """
    found, course = [FREE] * len(asked), aside.course
    parts, speeds, held = list[_Part](), list[FloatArray](), list[Sticks]()
    for place, one in enumerate(asked):
        speeds_m_s = (np.array(one.travels) - one.other_travel) * one.field.full_speed_m_s
        first = int(np.searchsorted(speeds_m_s, 0.0, side="right"))
        for sticks in dict.fromkeys((aside.sticks, AT_REST)) if first < len(speeds_m_s) else ():
            parts.append(_Part(place, first, slice(len(held), len(held) + len(speeds_m_s) - first)))
            speeds.append(speeds_m_s[first:])
            held += [sticks] * (len(speeds_m_s) - first)
    if not parts:
        return found
    # From here on one row for each zone and sticks.
    full_m_s, signs = np.empty((len(held), 1)), np.empty((len(held), 1))
    slow: BoolArray = np.zeros(len(held), dtype=bool)
    for part, speeds_m_s in zip(parts, speeds, strict=True):
        one = asked[part.asked]
        full_m_s[part.rows], signs[part.rows] = one.field.full_speed_m_s, 1.0 if one.forth else -1.0
        slow[part.rows] = speeds_m_s < touch_speed_m_s(one.field.full_speed_m_s)
        slow[part.rows.start] = True
    # In order, so that np.unique is not needed: its first call loads a part of NumPy, which takes longer than a turn.
    some = np.linspace(0, len(course.displacements_m) - 1, _UNDER_WAY).astype(np.int64)
    some = some[np.diff(some, prepend=-1) > 0]
    ahead_m, ahead_s = _ahead(course, signs, np.concatenate(speeds)[:, None], np.array(held), full_m_s, horizon_s)
    points = np.concatenate([course.aside_s[some], ahead_s.reshape(-1, 4)]) / aside.around.full_s
    free_m = contact_distances_m(aside.around.onsets_m(aside.horizon_m), points)
    # Lists of the map: R2's for fast zones and for slow ones, then L2's.
    lists, count = np.where(signs[:, 0] > 0.0, 0, 2) + slow, len(some)
    then_m = free_m[:, count:].reshape(len(free_m), len(held), -1)[lists, np.arange(len(held))]
    free_m = np.hstack([free_m[lists, :count], then_m])
    path_m = np.hstack([signs * course.displacements_m[some[1:]], ahead_m])
    # Between two points the shorter contact distance counts.
    short_m = (path_m - np.minimum(free_m[:, :-1], free_m[:, 1:])).max(axis=1)
    beyond = path_m[:, -1] > aside.horizon_m
    for part in parts:
        of_part = zip(slow[part.rows].tolist(), short_m[part.rows].tolist(), strict=True)
        strengths = _strengths(asked[part.asked].field, part.first, of_part)
        zones = Zones(strengths, int(beyond[part.rows].sum())) if any(strengths) else FREE
        found[part.asked] = zones.at_least(found[part.asked], MAX_STRENGTH)
    return found


def _strengths(field: TriggerField, first: int, found: Iterable[tuple[bool, float]]) -> Strengths:
    """Return the strengths of the zones; found: for each from `first` on, whether it is slow, and its excess in m."""
    strengths = [0] * first
    for of_slow, beyond_m in found:
        onsets = field.slow_m if of_slow else field.fast_m
        weaker = bisect_right(onsets, onsets[-1] + beyond_m) if beyond_m > -_RISES_M else 0
        strength = MAX_STRENGTH if beyond_m >= 0.0 else weaker
        strengths.append(max(strengths[-1] if strengths else 0, strength))
    return tuple(strengths)


def _ahead(
    course: Course,
    signs: FloatArray,
    speeds_m_s: FloatArray,
    sticks: FloatArray,
    full_m_s: FloatArray,
    horizon_s: float,
) -> tuple[FloatArray, FloatArray]:
    """Continue from the course's end at each row's speed (z, 1) for one reaction, then brake; sticks (z, 4) stay.

    signs (z, 1): 1 along the course's direction, -1 in the opposite one. full_m_s (z, 1): speed at full travel. Return,
    at k = _AHEAD times until standstill, the displacements (z, k) along the row's direction and the displacements by
    the sticks' axes (z, k, 4), as in Course. Gives the same as two calls of `common.following.follow_together`.
    """
    followed = np.hstack([signs * course.speed_m_s / full_m_s, np.broadcast_to(course.followed, sticks.shape)])
    targets = np.hstack([speeds_m_s / full_m_s, sticks])
    along = np.hstack([signs, np.ones(sticks.shape)])
    change = targets - followed
    changing_s = np.abs((along * change) @ course.changes_s.T).max(axis=1, keepdims=True)
    then = followed + change * np.minimum(horizon_s / np.maximum(changing_s, _LEAST_S), 1.0)
    braking = np.hstack([np.zeros_like(speeds_m_s), targets[:, 1:]]) - then
    braking_s = np.abs((along * braking) @ course.changes_s.T).max(axis=1, keepdims=True)
    after_s = np.arange(1, _AHEAD + 1) / _AHEAD * (horizon_s + braking_s)
    going_s, since_s = np.minimum(after_s, horizon_s), np.maximum(after_s - horizon_s, 0.0)
    passed = followed[:, None] * going_s[..., None] + change[:, None] * _counts_s(going_s, changing_s)[..., None]
    passed += then[:, None] * since_s[..., None] + braking[:, None] * _counts_s(since_s, braking_s)[..., None]
    return signs * course.displacements_m[-1] + full_m_s * passed[..., 0], course.aside_s[-1] + passed[..., 1:]


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
    moves, turns = (np.abs(aside[:, part]).max(axis=1) > _LEFT_OUT for part in (_ACROSS, _TURNED))
    across_m: FloatArray = np.broadcast_to(onsets_m[:, :1], (len(onsets_m), len(aside)))
    if moves.any():
        across_m = _between(np.dstack([here_m, sides_m[..., :ACROSS]]), aside[:, _ACROSS], linear=False)
    if not turns.any():
        return across_m
    turned_m = _between(np.dstack([here_m, sides_m[..., ACROSS:]]), aside[:, _TURNED], linear=True)
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
