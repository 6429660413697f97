"""Result of one lane, a pair in the vectorised loop: it is bounded, and marked if the pair needs precise forms."""

import math

from robot_side.compiled.kernel import inlined
from robot_side.overlap.solids.solid import Overlap, sphere_area, sphere_volume

LaneResult = tuple[Overlap, float]
"""(overlap, 1 if doubles do not suffice and the pair needs precise forms, else 0)"""

TINY = 1e-6
"""Share of the sphere's volume below which an overlap needs precise forms. There the lanes' error, some 4e-16 of the
sphere, would be more than 1e-9 of the overlap."""

FARTHEST_REFERENCE = 4.0
"""Distance of the reference point from the sphere's centre, in radii, beyond which digits are lost"""

FARTHEST_CORNER = 1e10
"""Distance of a corner from the sphere's centre, in radii, beyond which products of distances could overflow"""

CLEAR = 1.0 + 1e-9
"""Ratio of squared distance to squared radius above which there is certainly no contact, in spite of rounding"""

WELL_CLEAR = 1.1
"""The same ratio as CLEAR for lanes that lost digits"""


@inlined
def settle(
    overlap: Overlap,
    radius: float,
    solid_volume: float,
    nearest_2: float,
    lowest: float,
    reference_2: float,
    farthest: float,
    extent: float,
    imprecise: bool,
) -> LaneResult:
    """Return `overlap` within its bounds. If the solid's surface does not reach the sphere, return the exact result.

    All distances are from the sphere's centre. `nearest_2` is that of the surface, squared (m²). `lowest` (m) is the
    least signed distance below the planes of the faces, positive inside the solid. `reference_2` is that of the
    reference point, squared (m²), `farthest` (m) that of the farthest corner. `extent` (m) is the length of the longest
    edge. `imprecise`: whether digits were lost.
    """
    # Every choice is between computed values, so that it compiles to an instruction without a branch.
    volume, gradient, area = overlap
    whole, whole_area = sphere_volume(radius), sphere_area(radius)
    # `lowest` is at least the radius inside, and at most 0 outside: rounding cannot confuse the two.
    engulfed = (lowest > 0.5 * radius) & (solid_volume > 0.0)
    uncut_volume, uncut_area = whole if engulfed else 0.0, whole_area if engulfed else 0.0
    clear = WELL_CLEAR if imprecise else CLEAR
    apart = (nearest_2 > clear * (radius * radius)) | (solid_volume == 0.0)
    bounded_volume = min(max(volume, 0.0), whole, solid_volume)
    bounded_area = min(max(area, 0.0), whole_area)
    # For a solid smaller than the sphere, the error is smaller, too.
    tiny = TINY * whole * min(extent, radius)
    doubtful = (reference_2 > FARTHEST_REFERENCE**2 * (radius * radius)) | (bounded_volume * radius < tiny) | imprecise
    # After an overflow this is not finite, and the comparison is false.
    number = volume + gradient[0] + gradient[1] + gradient[2]
    sane = (farthest <= FARTHEST_CORNER * radius) & (abs(number) < math.inf)
    unsettled = 1.0 if doubtful else 0.0
    unsettled = 0.0 if apart else unsettled
    settled = (
        uncut_volume if apart else bounded_volume,
        (0.0 if apart else gradient[0], 0.0 if apart else gradient[1], 0.0 if apart else gradient[2]),
        uncut_area if apart else bounded_area,
    )
    return settled, unsettled if sane else 1.0
