"""Bounds on whether a pair can shorten any onset distance.

Rule: a bound may end the work early, never move a result. Regret: three bounds for three cases (the contact plane of a
convex primitive, Brunn and Minkowski's concave cube root, the sphere's disc) are more than one would wish.
"""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.field.samples import NOTHING, Profile
from robot_side.field.scratch import STRENGTHS, TOUCH_STRENGTH

_SLACK_M: Final = 5e-5
"""Smallest shortening of an onset distance that is pursued: many spheres of a face touch at once."""
_ENOUGH: Final = 1e-6
"""Share of R³ above which an overlap's tangent bounds well"""


@inlined
def latest_of(profile: Profile, level: int, distances: FloatArray) -> float:
    """Return the distance up to which the profile may shorten the onset distance of a strength."""
    pair = profile.pair
    latest: float = distances[0, level]
    if not pair.touchable or level < TOUCH_STRENGTH:
        latest = max(latest, distances[1, level] - pair.expected)
    return min(latest + profile.margin + float(pair.lead) - _SLACK_M, profile.end)


@inlined
def matters(profile: Profile, level: int, at: float, distances: FloatArray) -> bool:
    """Return whether the profile beyond `at` may shorten any onset distance from `level` on."""
    any_does = False
    for k in range(level, STRENGTHS):
        any_does = any_does or latest_of(profile, k, distances) > at
    return any_does


@inlined
def begin(profile: Profile, level: int, at: float, distances: FloatArray) -> None:
    """Shorten a strength's onset distances to the profile's onset `at`, if they are longer."""
    pair, found = profile.pair, at - profile.margin - profile.pair.lead
    distances[0, level] = min(distances[0, level], found)
    if not pair.touchable or level < TOUCH_STRENGTH:
        distances[1, level] = min(distances[1, level], found + pair.expected)


@inlined
def _cap(depth: float, radius: float) -> float:
    """Return the volume of a sphere's cap (eq. 12)."""
    height = min(max(depth, 0.0), 2.0 * radius)
    return math.pi * height * height * (3.0 * radius - height) / 3.0


@inlined
def _uncovered(distance: float, radius: float) -> float:
    """Return the volume that a ball newly covers after a distance: no overlap rises by more."""
    moved = min(max(distance, 0.0), 2.0 * radius)
    return math.pi * moved * (radius * radius - moved * moved / 12.0)


@inlined
def _touched(part: Any, least: float) -> tuple[float, float]:
    """Return the cube root of a part's newest overlap and its slope; infinite without a good tangent."""
    if not part.volume > least:
        return math.inf, 0.0
    root = part.volume ** (1.0 / 3.0)
    return root, part.slope / (3.0 * root * root)


@building_block
def keep_tangents(profile: Profile, at: float, second: bool, entries: np.ndarray) -> bool:
    """Keep the tangents of the newest sample, at `at`. Return whether V rises up to there.

    The cube root is concave while one convex primitive is entered (Brunn, Minkowski), so a tangent bounds it.
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
    """Return an upper bound of a cube root up to `at`; infinite for a tangent that falls, unless it touches at 0."""
    if steep > 0.0:
        return root + steep * (at - touches)
    return root if touches == 0.0 else math.inf


@inlined
def _most(profile: Profile, at: float, entries: np.ndarray) -> float:
    """Return an upper bound of V at a distance; infinite if a primitive is not convex."""
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
    """Return whether a pair may shorten any onset distance.

    baseline: V(0). full: least rise of the overlap at full strength. entries: with their bounds.
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
