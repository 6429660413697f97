"""Overlap profile of one gripper sphere and one object, and the onset distances that follow (§4.2).

    W(E) = max over 0 <= E' <= E of (V(E') - V(0))⁺,   d = sup{E >= 0 : W(E) = 0}
    s(D) = min(1, W(D + m) / max(W(d + m), m |∇V(0)|, V_min))

V(E) is the overlap after the distance E along û, s(D) the stiffness after D. V is sampled while an onset distance can
still become shorter (`bounds_on_rise`), and where a strength begins by the cubic between two samples (`samples`).
"""

import math
from typing import Final, NamedTuple

from robot_side.compiled.kernel import building_block, inlined
from robot_side.field.bounds_on_rise import begin, keep_tangents, latest_of, matters, may_count
from robot_side.field.samples import NOTHING, Profile, Sample, cubic, next_entry, on_cubic, peak, sample
from robot_side.field.scratch import SAMPLES, SCRATCH, STRENGTHS, Bundles, Count, ScratchColumns

scratch_at = SCRATCH.at
_TOLERANCE_M: Final = 2e-5
"""Length of the interval to which the search for an onset is narrowed"""
_NEWTON_M: Final = 5e-5
"""Distance from an onset up to which one last step of Newton's method finds it, without another sample"""
_DOUBT_M: Final = 5e-4
_DOUBT: Final = 1.0 / 6.0
"""Share of the distance between two samples, at most _DOUBT_M, by which the cubic's onset may be wrong. Onsets that are
too late by less are checked by samples."""
_MOST_STEPS: Final = 12
_MOST_SAMPLES: Final = 400
_MOST_OF_A_PEAK: Final = 4
_FLAT: Final = 0.005
"""Tolerance of a peak's overlap, as a share of the overlap's rise up to the peak"""
_FINE: Final = 1.0 / 6.0
_COARSE: Final = 0.5
"""Distance between samples beyond the margin, in margins: _FINE just before another primitive is entered, _COARSE
elsewhere"""
_EARLY: Final = 0.4
"""Position of the second sample of a smooth profile, in margins; weak strengths begin near it. Other profiles have this
sample in the middle, because it is one of the samples kept over the margin."""


class Rise(NamedTuple):
    """Where an overlap begins to rise, and by how much it must rise at least for full strength."""

    free: Sample
    """Sample at the contact distance d, up to which the overlap does not grow"""
    baseline: float
    """Overlap at the start, V(0)"""
    least: float
    """Smallest rise for full strength, max(m |∇V(0)|, V_min)"""


@building_block
def _crossing(profile: Profile, a: Sample, b: Sample, wanted: float, latest: float, bundles: Bundles) -> Sample:
    """Return the sample between `a` and `b` where V first reaches `wanted`.

    If V does so only beyond the distance `latest`, any sample at or beyond `latest` is returned: it has no effect.
    """
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
def _top(profile: Profile, a: Sample, b: Sample, baseline: float, bundles: Bundles) -> tuple[bool, Sample]:
    """Return whether V has a peak between two samples, and the sample with the highest overlap.

    V may have a peak even if it rises at both samples, or falls at both. At a kink the cubic's peak is inaccurate, so
    the search repeats with the new sample.
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
        if abs(top.slope) * (b.at - a.at) <= _FLAT * (top.volume - baseline):
            break
    return peaks, best


@building_block
def _first_rise(profile: Profile, last: Sample, rises: bool, full: float, bundles: Bundles) -> tuple[bool, Rise]:
    """Find the contact distance d of a pair that overlaps at the start: the overlap may first fall, then grow.

    Return False if no onset distance can become shorter. last: sample at 0. rises: whether any primitive's overlap may
    rise from there. full: smallest rise of the overlap for full strength.
    """
    scratch, baseline, pair = scratch_at(bundles.scratch), last.volume, profile.pair
    ball = 4.0 / 3.0 * math.pi * profile.pair.radius**3
    disc, step = math.pi * pair.radius * pair.radius, _FINE * profile.margin
    # A rise within rounding does not count.
    if last.slope * _TOLERANCE_M > NOTHING * ball:
        return True, Rise(last, baseline, full)
    given_up = True
    for _ in range(_MOST_SAMPLES):
        if not matters(profile, 0, last.at, scratch.distances_m):
            given_up = False
            break
        at = last.at + max(step, (baseline - last.volume) / disc)
        if not rises:
            at = max(next_entry(profile, last.at, scratch), last.at + (baseline - last.volume) / disc)
            if at >= profile.end:
                given_up = False
                break
        found, _, may_rise = sample(profile, at, bundles)
        if rises and found.volume - baseline <= NOTHING * ball:
            _, found_top = _top(profile, last, found, baseline, bundles)
            found = found_top if found_top.volume - baseline > NOTHING * ball else found
        if rises and found.volume - baseline > NOTHING * ball:
            for _ in range(_MOST_STEPS):
                if found.at - last.at <= _TOLERANCE_M:
                    break
                middle, _, _ = sample(profile, 0.5 * (last.at + found.at), bundles)
                if middle.volume - baseline > NOTHING * ball:
                    found = middle
                else:
                    last = middle
            return True, Rise(last, baseline, full)
        last, rises = found, may_rise
    # Without an end of the search, the overlap counts as rising from the last sample on: too early rather than never.
    return given_up, Rise(last, baseline, full)


@building_block
def _most_over_margin(profile: Profile, rise: Rise, middle: Sample, full: Sample, bundles: Bundles) -> float:
    """Return W(d + m), and keep the samples over the margin. middle, full: samples at the margin's middle and end."""
    scratch = scratch_at(bundles.scratch)
    samples, step, most = scratch.samples, profile.margin / SAMPLES, max(0.0, full.volume - rise.baseline)
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
        most = max(most, found.volume - rise.baseline)
        if k > 0:
            _, top = _top(profile, last, found, rise.baseline, bundles)
            most = max(most, top.volume - rise.baseline)
        last = found
    return most


@inlined
def _take(
    profile: Profile, level: int, a: Sample, b: Sample, baseline: float, reference: float, bundles: Bundles
) -> int:
    """Shorten the onset distances of the strengths, from `level` on, that begin between two samples.

    Return the first level that does not. reference: rise of the overlap at full strength.
    """
    distances = scratch_at(bundles.scratch).distances_m
    while level < STRENGTHS:
        wanted = baseline + (level + 0.5) / STRENGTHS * reference
        if b.volume < wanted:
            break
        latest = latest_of(profile, level, distances)
        if latest > a.at:
            found = a if a.volume >= wanted else on_cubic(a, b, wanted)
            if found.at < latest + min(_DOUBT * (b.at - a.at), _DOUBT_M) and a.volume < wanted:
                found = _crossing(profile, a, b, wanted, latest, bundles)
                # The sample serves the next strength, too.
                a = found
            if found.at < latest:
                begin(profile, level, found.at, distances)
        level += 1
    return level


@building_block
def follow(profile: Profile, least: float, waits: bool, bundles: Bundles) -> bool:
    """Shorten the onset distances by one pair. Return True if nothing was done: call again after all other pairs.

    least: V_min. waits: whether a pair whose overlap falls at first is put off, because it takes many samples.
    """
    scratch = scratch_at(bundles.scratch)
    pair, distances, entries, margin = profile.pair, scratch.distances_m, scratch.entries, profile.margin
    rise = Rise(Sample(pair.contact, 0.0, 0.0), 0.0, least)
    if pair.overlaps:
        first, initial_gradient, rises = sample(profile, 0.0, bundles)
        if waits and rises and first.slope <= 0.0:
            return True
        scratch.counts[Count.PROFILES] += 1
        keep_tangents(profile, 0.0, True, entries)
        if not may_count(profile, first.volume, max(least, margin * initial_gradient), distances, entries):
            return False
        rises, rise = _first_rise(profile, first, rises, max(least, margin * initial_gradient), bundles)
        if not (rises and may_count(profile, rise.baseline, rise.least, distances, entries)):
            return False
    elif not may_count(profile, 0.0, least, distances, entries):
        return False
    else:
        scratch.counts[Count.PROFILES] += 1
    free, baseline = rise.free, rise.baseline
    full, _, may_rise = sample(profile, free.at + margin, bundles)
    reference, smooth = max(rise.least, full.volume - baseline), keep_tangents(profile, full.at, False, entries)
    if not may_count(profile, baseline, reference, distances, entries):
        return False
    second, _, _ = sample(profile, free.at + (_EARLY if smooth else 0.5) * margin, bundles)
    keep_tangents(profile, second.at, True, entries)
    if not may_count(profile, baseline, reference, distances, entries):
        return False
    level, stored, last = 0, 0, free
    if smooth:
        # The overlap with convex primitives rises up to `full`.
        level = _take(profile, level, free, second, baseline, reference, bundles)
        level = _take(profile, level, second, full, baseline, reference, bundles)
        last = full
    elif _is_late(profile, free, second, full, baseline, reference, scratch):
        return False
    else:
        reference, stored = max(reference, _most_over_margin(profile, rise, second, full, bundles)), SAMPLES
    _go_on(profile, level, last, stored, may_rise, rise, reference, bundles)
    return False


@building_block
def _is_late(
    profile: Profile,
    free: Sample,
    second: Sample,
    full: Sample,
    baseline: float,
    reference: float,
    scratch: ScratchColumns,
) -> bool:
    """Return whether the overlap seems to rise all along the margin, and every strength begins too late to count.

    free, second, full: samples at the beginning of the margin, within it and at its end; `second` is the newest.
    """
    for k in range(profile.entries):
        part = scratch.entries[k]
        # What is small may have been grazed and left before the first sample.
        if part.closing > 0.0 and part.enters < second.at and not (part.volume > 0.0 and part.slope >= 0.0):
            return False
    if not (baseline <= second.volume <= full.volume and min(free.slope, second.slope, full.slope) >= 0.0):
        return False
    late = True
    for level in range(STRENGTHS):
        latest = latest_of(profile, level, scratch.distances_m)
        at = min(latest + _DOUBT * (full.at - second.at), full.at)
        a, b = (free, second) if at < second.at else (second, full)
        reached = cubic(a, b, max(at - a.at, 0.0) / (b.at - a.at))
        late = late and latest <= full.at and reached - baseline < (level + 0.5) / STRENGTHS * reference
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
    """Shorten the onset distances of the strengths, from `level` on, that begin beyond the sample `last`.

    The first `stored` samples are those kept over the margin; later ones are computed. may_rise: whether any
    primitive's overlap may rise beyond the last of them.
    """
    scratch, baseline = scratch_at(bundles.scratch), rise.baseline
    for k in range(_MOST_SAMPLES):
        if level == STRENGTHS or not matters(profile, level, last.at, scratch.distances_m):
            break
        if k < stored:
            at = rise.free.at + (k + 1) * profile.margin / SAMPLES
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
        peaks, top = _top(profile, last, found, baseline, bundles)
        if peaks:
            level = _take(profile, level, last, top, baseline, reference, bundles)
            last = top
        level = _take(profile, level, last, found, baseline, reference, bundles)
        last = found
