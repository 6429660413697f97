"""The overlap profile of one gripper sphere and one object, and where it makes strengths begin (§4.2).

    W(E) = max over 0 <= E' <= E of (V(E') - V(0))⁺,   d = sup{E >= 0 : W(E) = 0}
    s(D) = min(1, W(D + m) / max(W(d + m), m |∇V(0)|, V_min))

V(E) is the overlap after the distance E along û. It is sampled only as far as a strength can still begin sooner than
those known so far (`sooner`). Between two samples goes a cubic (`samples`); where it says that a strength begins, V is
asked.
"""

import math
from typing import Final, NamedTuple

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.field.samples import NOTHING, Profile, Sample, cubic, next_entry, on_cubic, peak, sample
from robot_side.field.scratch import SAMPLES, SCRATCH, STRENGTHS, Bundles, Count
from robot_side.field.sooner import begin, keep_tangents, latest_of, matters, may_count

scratch_at = SCRATCH.at
_TOLERANCE_M: Final = 2e-5
"""A strength's beginning is known this well."""
_NEWTON_M: Final = 5e-5
"""From so near, Newton's method goes to where it begins."""
_DOUBT_M: Final = 5e-4
_DOUBT: Final = 1.0 / 6.0
"""The cubic is trusted up to this share of the distance between its samples to say that a strength begins too late."""
_MOST_STEPS: Final = 12
_MOST_SAMPLES: Final = 400
_MOST_OF_A_PEAK: Final = 4
_FLAT: Final = 0.005
"""A peak is known this well, as a share of what the overlap has risen by."""
_FINE: Final = 1.0 / 6.0
_COARSE: Final = 0.5
"""The distance between samples beyond the margin, in margins: where another primitive is entered, and elsewhere."""
_EARLY: Final = 0.4
"""The share of the margin at which a second sample of a smooth profile lies: early strengths begin there. Other
profiles keep samples over the margin, of which the second one is the middle."""


class Rise(NamedTuple):
    """The distance at which an overlap begins to rise, the overlap there, and the rise that full strength takes."""

    free: Sample
    """At d"""
    floor: float
    """V(0)"""
    least: float
    """max(m |∇V(0)|, V_min)"""


@building_block
def _crossing(profile: Profile, a: Sample, b: Sample, wanted: float, latest: float, bundles: Bundles) -> Sample:
    """The first distance between two samples at which V passes a volume; or one from `latest` on, if that is later."""
    for step in range(_MOST_STEPS):
        guess = on_cubic(a, b, wanted)
        if b.at - a.at <= _TOLERANCE_M:
            return guess
        # The cubic converges slowly where V has a kink.
        at = guess.at if step < 3 else 0.5 * (a.at + b.at)
        found, _, _ = sample(profile, min(at, latest), bundles)
        off = found.volume - wanted
        if abs(off) <= _NEWTON_M * found.slope:
            return Sample(found.at - off / found.slope, wanted, found.slope)
        if off < 0.0:
            if found.at >= latest:
                return found
            a = found
        else:
            b = found
    return b


@building_block
def _top(profile: Profile, a: Sample, b: Sample, floor: float, bundles: Bundles) -> tuple[bool, Sample]:
    """The highest overlap between two samples; False where the cubic has no peak there.

    It may have one although V rises, or falls, at both. A peak with a kink is no cubic's, and is asked for again.
    """
    best = a if a.volume > b.volume else b
    peaks = False
    for _ in range(_MOST_OF_A_PEAK):
        part = peak(a, b)
        if part < 0.0:
            break
        top, _, _ = sample(profile, a.at + part * (b.at - a.at), bundles)
        if top.volume > best.volume:
            peaks, best = True, top
        a, b = (top, b) if top.slope > 0.0 else (a, top)
        if abs(top.slope) * (b.at - a.at) <= _FLAT * (top.volume - floor):
            break
    return peaks, best


@building_block
def _first_rise(profile: Profile, last: Sample, rises: bool, full: float, bundles: Bundles) -> tuple[bool, Rise]:
    """Look for d beyond the sample at 0 of a pair that overlaps there; False where no strength can begin sooner.

    full: at least what full strength takes.
    """
    scratch, floor = scratch_at(bundles.scratch), last.volume
    pair, ball = profile.pair, 4.0 / 3.0 * math.pi * profile.pair.radius**3
    disc, step = math.pi * pair.radius * pair.radius, _FINE * profile.margin
    # What rises by rounding alone, to fall at once, has not begun to.
    if last.slope * _TOLERANCE_M > NOTHING * ball:
        return True, Rise(last, floor, full)
    given_up = True
    for _ in range(_MOST_SAMPLES):
        if not matters(profile, 0, last.at, scratch.distances_m):
            given_up = False
            break
        at = last.at + max(step, (floor - last.volume) / disc)
        if not rises:
            at = max(next_entry(profile, last.at, scratch), last.at + (floor - last.volume) / disc)
            if at >= profile.end:
                given_up = False
                break
        found, _, may_rise = sample(profile, at, bundles)
        if rises and found.volume - floor <= NOTHING * ball:
            _, found_top = _top(profile, last, found, floor, bundles)
            found = found_top if found_top.volume - floor > NOTHING * ball else found
        if rises and found.volume - floor > NOTHING * ball:
            for _ in range(_MOST_STEPS):
                if found.at - last.at <= _TOLERANCE_M:
                    break
                middle, _, _ = sample(profile, 0.5 * (last.at + found.at), bundles)
                if middle.volume - floor > NOTHING * ball:
                    found = middle
                else:
                    last = middle
            return True, Rise(last, floor, full)
        last, rises = found, may_rise
    # After the most samples the overlap counts as rising from there: early, and never silent.
    return given_up, Rise(last, floor, full)


@building_block
def _most_over_margin(profile: Profile, rise: Rise, middle: Sample, full: Sample, bundles: Bundles) -> float:
    """Work out W(d + m), and keep samples over the margin; middle, full: those at half of it, and at its end."""
    scratch = scratch_at(bundles.scratch)
    samples, step, most = scratch.samples, profile.margin / SAMPLES, max(0.0, full.volume - rise.floor)
    last = rise.free
    for k in range(SAMPLES + 1):
        if k == 0:
            found = rise.free
        elif k == SAMPLES // 2:
            found = middle
        elif k == SAMPLES:
            found = full
        else:
            found, _, _ = sample(profile, rise.free.at + k * step, bundles)
        samples[k, 0], samples[k, 1] = found.volume, found.slope
        most = max(most, found.volume - rise.floor)
        if k > 0:
            _, top = _top(profile, last, found, rise.floor, bundles)
            most = max(most, top.volume - rise.floor)
        last = found
    return most


@inlined
def _take(
    profile: Profile,
    level: int,
    a: Sample,
    b: Sample,
    floor: float,
    reference: float,
    bundles: Bundles,
) -> int:
    """Let the strengths begin that do so between two samples, from `level` on; the next one."""
    distances = scratch_at(bundles.scratch).distances_m
    while level < STRENGTHS:
        wanted = floor + (level + 0.5) / STRENGTHS * reference
        if b.volume < wanted:
            break
        latest = latest_of(profile, level, distances)
        if latest > a.at:
            found = a if a.volume >= wanted else on_cubic(a, b, wanted)
            if found.at < latest + min(_DOUBT * (b.at - a.at), _DOUBT_M) and a.volume < wanted:
                found = _crossing(profile, a, b, wanted, latest, bundles)
                # What is known there serves the next strength, too.
                a = found
            if found.at < latest:
                begin(profile, level, found.at, distances)
        level += 1
    return level


@building_block
def follow(profile: Profile, least: float, waits: bool, bundles: Bundles) -> bool:
    """Shorten the distances at which strengths begin by one pair; True: ask again, after all other pairs.

    least: V_min. waits: a pair whose overlap falls at first may wait, as it takes many samples.
    """
    scratch = scratch_at(bundles.scratch)
    pair, distances, entries, margin = profile.pair, scratch.distances_m, scratch.entries, profile.margin
    rise = Rise(Sample(pair.contact, 0.0, 0.0), 0.0, least)
    if pair.overlaps:
        first, lean, rises = sample(profile, 0.0, bundles)
        if waits and rises and first.slope <= 0.0:
            return True
        scratch.counts[Count.PROFILES] += 1
        keep_tangents(profile, 0.0, True, entries)
        if not may_count(profile, first.volume, max(least, margin * lean), distances, entries):
            return False
        rises, rise = _first_rise(profile, first, rises, max(least, margin * lean), bundles)
        if not (rises and may_count(profile, rise.floor, rise.least, distances, entries)):
            return False
    elif not may_count(profile, 0.0, least, distances, entries):
        return False
    else:
        scratch.counts[Count.PROFILES] += 1
    free, floor = rise.free, rise.floor
    full, _, may_rise = sample(profile, free.at + margin, bundles)
    reference, smooth = max(rise.least, full.volume - floor), keep_tangents(profile, full.at, False, entries)
    if not may_count(profile, floor, reference, distances, entries):
        return False
    second, _, _ = sample(profile, free.at + (_EARLY if smooth else 0.5) * margin, bundles)
    keep_tangents(profile, second.at, True, entries)
    if not may_count(profile, floor, reference, distances, entries):
        return False
    level, stored, last = 0, 0, free
    if smooth:
        # The overlap with convex primitives rises until there.
        level = _take(profile, level, free, second, floor, reference, bundles)
        level = _take(profile, level, second, full, floor, reference, bundles)
        last = full
    elif _is_late(profile, free, second, full, floor, reference, distances):
        return False
    else:
        reference, stored = max(reference, _most_over_margin(profile, rise, second, full, bundles)), SAMPLES
    _go_on(profile, level, last, stored, may_rise, rise, reference, bundles)
    return False


@building_block
def _is_late(
    profile: Profile, free: Sample, second: Sample, full: Sample, floor: float, reference: float, distances: FloatArray
) -> bool:
    """Whether an overlap that seems to rise all along the margin lets every strength begin too late to count."""
    if not (floor <= second.volume <= full.volume and min(free.slope, second.slope, full.slope) >= 0.0):
        return False
    late = True
    for level in range(STRENGTHS):
        latest = latest_of(profile, level, distances)
        at = min(latest + _DOUBT * (full.at - second.at), full.at)
        a, b = (free, second) if at < second.at else (second, full)
        reached = cubic(a, b, max(at - a.at, 0.0) / (b.at - a.at))
        late = late and latest <= full.at and reached - floor < (level + 0.5) / STRENGTHS * reference
    return late


@building_block
def _go_on(
    profile: Profile,
    level: int,
    last: Sample,
    stored: int,
    may_rise: bool,
    rise: Rise,
    reference: float,
    bundles: Bundles,
) -> None:
    """Let the strengths from `level` on begin beyond a sample, of which the first `stored` steps are kept."""
    scratch, floor = scratch_at(bundles.scratch), rise.floor
    step = profile.margin / SAMPLES
    for k in range(_MOST_SAMPLES):
        if level == STRENGTHS or not matters(profile, level, last.at, scratch.distances_m):
            break
        if k < stored:
            at = rise.free.at + (k + 1) * step
            found = Sample(at, scratch.samples[k + 1, 0], scratch.samples[k + 1, 1])
        else:
            comes = next_entry(profile, last.at, scratch)
            if not may_rise and comes == math.inf:
                break
            near = comes < last.at + _COARSE * profile.margin
            at = last.at + (_FINE if near else _COARSE) * profile.margin
            if not may_rise:
                at = max(at, comes)
            found, _, may_rise = sample(profile, at, bundles)
        peaks, top = _top(profile, last, found, floor, bundles)
        if peaks:
            level = _take(profile, level, last, top, floor, reference, bundles)
            last = top
        level = _take(profile, level, last, found, floor, reference, bundles)
        last = found
