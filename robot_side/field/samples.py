"""Samples of the overlap profile of one gripper sphere and one object, and the cubic between two of them (Hermite)."""

import math
from typing import Any, Final, NamedTuple

from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, dot, scale
from robot_side.field.scratch import MOST_WORK, SCRATCH, Bundles, Count, ScratchColumns
from robot_side.surroundings.overlaps import overlap
from robot_side.surroundings.scene_columns import SCENE, contact_in_front

scene_at, scratch_at = SCENE.at, SCRATCH.at
NOTHING: Final = 1e-9
"""Share of the sphere's volume, or of its disc's area, below which a change of V, or its slope, is only rounding"""


class Profile(NamedTuple):
    """A pair of gripper sphere and object, with the parameters of the pair's overlap profile."""

    pair: Any
    entries: int
    """Number of the scratch's entries that belong to the pair, from the first on"""
    center: Vector
    along: Vector
    margin: float
    end: float
    """Distance at which the profile ends: strengths that begin farther on lie beyond the examined distance"""


class Sample(NamedTuple):
    """Overlap V and its slope dV/dE after the distance E = `at` along û."""

    at: float
    volume: float
    slope: float


@building_block
def sample(profile: Profile, at: float, bundles: Bundles) -> tuple[Sample, float, bool]:
    """Compute V after the distance `at`. Return the sample, |∇V|, and whether any primitive's part may still rise."""
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    radius, overlap_gradient = profile.pair.radius, scratch.overlap_gradient
    center = add(profile.center, scale(at, profile.along))
    volume, gradient, may_rise = 0.0, (0.0, 0.0, 0.0), False
    # Beyond the limit the look's result is discarded: the search only has to end.
    entries = profile.entries if scratch.counts[Count.OVERLAPS] <= MOST_WORK else 0
    for k in range(entries):
        entry = scratch.entries[k]
        if entry.enters > at:
            continue
        kind = scene.kinds[entry.row]
        part = overlap(kind, scene.kernels, scene.shapes, entry.row, center, radius, scene.meshes, overlap_gradient)
        slope = (
            overlap_gradient[0] * profile.along[0]
            + overlap_gradient[1] * profile.along[1]
            + overlap_gradient[2] * profile.along[2]
        )
        volume, gradient = volume + part, add(gradient, (overlap_gradient[0], overlap_gradient[1], overlap_gradient[2]))
        scratch.counts[Count.OVERLAPS] += 1
        entry.volume, entry.slope = part, slope
        rising = slope > NOTHING * math.pi * radius * radius or part <= NOTHING * radius**3
        if entry.closing == 0.0 and not rising:
            # A mesh's part may rise again where the sphere touches the next front triangle.
            left = profile.end - at
            entry.again = at + contact_in_front(scene, entry.row, center, profile.along, radius, left)
            rising = entry.again <= at
        may_rise = may_rise or rising
    size = math.sqrt(dot(gradient, gradient))
    return Sample(at, volume, dot(gradient, profile.along)), size, may_rise


@inlined
def next_entry(profile: Profile, at: float, scratch: ScratchColumns) -> float:
    """Return the next distance beyond `at` where another primitive is entered, or a part that fell may rise again."""
    nearest = math.inf
    for k in range(profile.entries):
        entry = scratch.entries[k]
        comes = entry.enters if entry.enters > at else entry.again
        if comes > at:
            nearest = min(nearest, comes)
    return nearest


@inlined
def cubic(a: Sample, b: Sample, part: float) -> float:
    """Return the cubic's V between two samples, at the share `part`, 0 to 1, of the distance from `a` to `b`."""
    rest, step = 1.0 - part, b.at - a.at
    return (
        rest * rest * (1.0 + 2.0 * part) * a.volume
        + part * part * (3.0 - 2.0 * part) * b.volume
        + step * part * rest * (rest * a.slope - part * b.slope)
    )


@inlined
def cubic_slope(a: Sample, b: Sample, part: float) -> float:
    """Return the derivative of `cubic` with respect to `part`."""
    rest, step = 1.0 - part, b.at - a.at
    return 6.0 * (b.volume - a.volume) * part * rest + step * (
        a.slope * rest * (1.0 - 3.0 * part) + b.slope * part * (3.0 * part - 2.0)
    )


@inlined
def peak(a: Sample, b: Sample) -> float:
    """Return where the cubic has its peak, as a share 0 to 1 of the distance from `a` to `b`; -1 without a peak."""
    step, rise = b.at - a.at, b.volume - a.volume
    begin, end = step * a.slope, step * b.slope
    # Root of dV = begin + bend t + more t² at which dV falls.
    bend, more = 2.0 * (3.0 * rise - 2.0 * begin - end), 3.0 * (begin + end - 2.0 * rise)
    inside = bend * bend - 4.0 * begin * more
    if inside <= 0.0:
        return -1.0
    root = math.sqrt(inside)
    part = 2.0 * begin / (root - bend) if bend < 0.0 else (-bend - root) / (2.0 * more)
    return part if 0.0 < part < 1.0 else -1.0


@inlined
def on_cubic(a: Sample, b: Sample, wanted: float) -> Sample:
    """Return the point where the cubic between two samples reaches the volume `wanted`.

    It takes steps of Newton's method, and bisects where a step would leave the bracket.
    """
    low, high, part = 0.0, 1.0, 0.5
    for _ in range(8):
        off = cubic(a, b, part) - wanted
        low, high = (part, high) if off < 0.0 else (low, part)
        steep = cubic_slope(a, b, part)
        part -= off / steep if steep > 0.0 else 0.0
        if not low < part < high:
            part = 0.5 * (low + high)
    step = b.at - a.at
    return Sample(a.at + part * step, wanted, cubic_slope(a, b, part) / step)
