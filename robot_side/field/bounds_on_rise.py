"""Upper bounds of an overlap, which show early that a pair of sphere and object can shorten no onset distance.

A bound may only end the work early; it never changes a result. There are three bounds: by the contact plane of a convex
primitive, by the concave cube root of the overlap (Brunn and Minkowski), and by the disc of the moving sphere.
"""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.field.samples import NOTHING, Profile
from robot_side.field.scratch import STRENGTHS, TOUCH_STRENGTH

_SLACK_M: Final = 5e-5
"""Smallest shortening of an onset distance that is worth computing, as many spheres of a face touch nearly at once"""
_ENOUGH: Final = 1e-6
"""Share of R³ above which an overlap's tangent is accurate enough to bound the overlap"""


@inlined
def latest_of(profile: Profile, level: int, distances: FloatArray) -> float:
    """Return the distance along the profile beyond which the onset of a strength shortens no onset distance."""
    pair = profile.pair
    latest: float = distances[0, level]
    if not pair.touchable or level < TOUCH_STRENGTH:
        latest = max(latest, distances[1, level] - pair.expected)
    return min(latest + profile.margin + float(pair.lead) - _SLACK_M, profile.end)


@inlined
def matters(profile: Profile, level: int, at: float, distances: FloatArray) -> bool:
    """Return whether the profile beyond `at` may still shorten an onset distance of any strength from `level` on."""
    any_does = False
    for k in range(level, STRENGTHS):
        any_does = any_does or latest_of(profile, k, distances) > at
    return any_does


@inlined
def begin(profile: Profile, level: int, at: float, distances: FloatArray) -> None:
    """Shorten a strength's fast and slow onset distances to its onset `at` in this profile, if they are longer."""
    pair, found = profile.pair, at - profile.margin - profile.pair.lead
    distances[0, level] = min(distances[0, level], found)
    if not pair.touchable or level < TOUCH_STRENGTH:
        distances[1, level] = min(distances[1, level], found + pair.expected)


@inlined
def _cap(depth: float, radius: float) -> float:
    """Return the volume of a sphere's cap of height `depth`, V_c of eq. 12."""
    height = min(max(depth, 0.0), 2.0 * radius)
    return math.pi * height * height * (3.0 * radius - height) / 3.0


@inlined
def _uncovered(distance: float, radius: float) -> float:
    """Return the part of a ball's volume outside its former place after it moves by `distance`.

    No overlap rises by more.
    """
    moved = min(max(distance, 0.0), 2.0 * radius)
    return math.pi * moved * (radius * radius - moved * moved / 12.0)


@inlined
def _touched(part: Any, least: float) -> tuple[float, float]:
    """Return the cube root of one primitive's newest overlap, and the root's slope along û.

    Where the overlap is at most `least`, a tangent would bound badly: the root is infinite then.
    """
    if not part.volume > least:
        return math.inf, 0.0
    root = part.volume ** (1.0 / 3.0)
    return root, part.slope / (3.0 * root * root)


@building_block
def keep_tangents(profile: Profile, at: float, second: bool, entries: np.ndarray) -> bool:
    """Keep, for each entered primitive, the tangent to the cube root of its overlap at the newest sample, at `at`.

    The cube root is concave while a sphere enters a convex primitive (Brunn, Minkowski), so a tangent bounds it. An
    entry holds two tangents; second: which one is written. Return whether all entered primitives are convex and their
    overlaps still rise at `at`: then V rises all the way up to `at`.
    """
    least, falls = _ENOUGH * profile.pair.radius**3, -NOTHING * math.pi * profile.pair.radius**2
    rises = True
    for k in range(profile.entries):
        part = entries[k]
        if part.enters > at:
            continue
        rises = rises and part.closing > 0.0 and part.slope >= (falls if part.volume > least else 0.0)
        rises = rises and part.volume > 0.0
        root, steep = _touched(part, least)
        if second:
            part.at_1, part.root_1, part.steep_1 = at, root, steep
        else:
            part.at_0, part.root_0, part.steep_0 = at, root, steep
    return rises


@inlined
def _by_tangent(at: float, touches: float, root: float, steep: float) -> float:
    """Return an upper bound of a concave cube root at all distances up to `at`, from its tangent at `touches`.

    A tangent that falls bounds only what follows. So its bound is infinite unless it touches at distance 0.
    """
    if steep > 0.0:
        return root + steep * (at - touches)
    return root if touches == 0.0 else math.inf


@inlined
def _most(profile: Profile, at: float, entries: np.ndarray) -> float:
    """Return an upper bound of V at all distances up to `at`; infinite if an entered primitive is not convex."""
    most = 0.0
    for k in range(profile.entries):
        part = entries[k]
        if part.enters < at:
            by_first = _by_tangent(at, part.at_0, part.root_0, part.steep_0)
            root = max(min(by_first, _by_tangent(at, part.at_1, part.root_1, part.steep_1)), 0.0)
            own = root * root * root if part.closing > 0.0 else math.inf
            if part.closing > 0.0 and part.enters > 0.0:
                own = min(own, _cap(part.closing * (at - part.enters), profile.pair.radius))
            most += own
    return most


@building_block
def may_count(profile: Profile, baseline: float, full: float, distances: FloatArray, entries: np.ndarray) -> bool:
    """Return whether a pair may still shorten any onset distance, by the bounds of its overlap.

    baseline: V(0). full: smallest rise of the overlap that can mean full strength. entries: the pair's, with tangents.
    """
    pair = profile.pair
    for level in range(STRENGTHS):
        at = latest_of(profile, level, distances)
        if at <= pair.contact:
            continue
        wanted = (level + 0.5) / STRENGTHS * full
        if _uncovered(at - pair.contact, pair.radius) * (1.0 + 1e-9) < wanted:
            continue
        if (_most(profile, at, entries) - baseline) * (1.0 + 1e-9) >= wanted:
            return True
    return False
