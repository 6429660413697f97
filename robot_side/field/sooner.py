"""Whether a pair can make any strength begin sooner than it does by now.

Rule: a bound may end the work early, never move a result. Regret: three bounds for three cases (the plane that a convex
primitive is touched in, Brunn and Minkowski's concave cube root, the sphere's disc) are more than one would wish.
"""

import math
from typing import Final

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.field.samples import Profile, Sample
from robot_side.field.scratch import STRENGTHS, TOUCH_STRENGTH

_SLACK_M: Final = 5e-5
"""A strength that would begin sooner by less than this is left as it is: many spheres of a face touch at once."""
_ENOUGH: Final = 1e-6
"""Overlaps above this share of R³ have a tangent that bounds well."""


@inlined
def latest_of(profile: Profile, level: int, distances: FloatArray) -> float:
    """Up to which distance the pair may make a strength begin sooner than it does by now."""
    pair = profile.pair
    latest: float = distances[0, level]
    if not pair.touchable or level < TOUCH_STRENGTH:
        latest = max(latest, distances[1, level] - pair.expected)
    return min(latest + profile.margin + float(pair.lead) - _SLACK_M, profile.end)


@inlined
def matters(profile: Profile, level: int, at: float, distances: FloatArray) -> bool:
    """Whether any strength from `level` on may still begin sooner, if it begins beyond `at`."""
    any_does = False
    for k in range(level, STRENGTHS):
        any_does = any_does or latest_of(profile, k, distances) > at
    return any_does


@inlined
def begin(profile: Profile, level: int, at: float, distances: FloatArray) -> None:
    """Let a strength begin where the profile says so, unless it begins sooner by now."""
    pair, found = profile.pair, at - profile.margin - profile.pair.lead
    distances[0, level] = min(distances[0, level], found)
    if not pair.touchable or level < TOUCH_STRENGTH:
        distances[1, level] = min(distances[1, level], found + pair.expected)


@inlined
def _cap(depth: float, radius: float) -> float:
    """The volume of a sphere's cap (eq. 12)."""
    height = min(max(depth, 0.0), 2.0 * radius)
    return math.pi * height * height * (3.0 * radius - height) / 3.0


@inlined
def _uncovered(distance: float, radius: float) -> float:
    """The part of a ball that it has newly moved into after a distance: no overlap rises by more."""
    moved = min(max(distance, 0.0), 2.0 * radius)
    return math.pi * moved * (radius * radius - moved * moved / 12.0)


@inlined
def _root(sample: Sample) -> tuple[float, float]:
    """The cube root of an overlap, and its slope; concave while one convex primitive is entered (Brunn, Minkowski)."""
    root = sample.volume ** (1.0 / 3.0)
    return (root, sample.slope / (3.0 * root * root)) if sample.slope > 0.0 else (math.inf, 0.0)


@building_block
def may_count(
    profile: Profile, closing: float, floor: float, full: float, first: Sample, second: Sample, distances: FloatArray
) -> bool:
    """Whether a pair may make any strength begin sooner.

    closing: see `follow`. floor: V(0). full: at least what full strength takes. first, second: samples whose tangents
    bound what one convex primitive adds, of volume 0 for none.
    """
    pair, least = profile.pair, _ENOUGH * profile.pair.radius**3
    root, steep = _root(first) if first.volume > least else (math.inf, 0.0)
    other_root, other_steep = _root(second) if second.volume > least else (math.inf, 0.0)
    for level in range(STRENGTHS):
        at = latest_of(profile, level, distances)
        if at <= pair.contact:
            continue
        most = _uncovered(at - pair.contact, pair.radius)
        if closing > 0.0:
            bound = min(root + steep * (at - first.at), other_root + other_steep * (at - second.at))
            most = min(most, max(bound, 0.0) ** 3 - floor)
            if not pair.overlaps:
                most = min(most, _cap(closing * (at - pair.contact), pair.radius))
        if most * (1.0 + 1e-9) >= (level + 0.5) / STRENGTHS * full:
            return True
    return False
