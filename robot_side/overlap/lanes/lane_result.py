"""What becomes of a lane's sums: bounds, exact answers where nothing is cut, and which pairs need precise forms."""

import math

from robot_side.compiled.kernel import inlined
from robot_side.overlap.closed_forms.solid import Overlap, sphere_area, sphere_volume

LaneResult = tuple[Overlap, float]
"""(overlap, 1 where doubles do not settle it, so that the pair needs precise forms, else 0)"""

TINY = 1e-6
"""Below this share of the sphere's volume an overlap is worked out precisely: the lanes' error, some 4e-16 of the
sphere, would be more than 1e-9 of it."""

FARTHEST_REFERENCE = 4.0
"""A reference point farther than so many radii from the sphere's centre costs digits."""

FARTHEST_CORNER = 1e10
"""Corners beyond so many radii could make products of distances overflow."""

CLEAR = 1.0 + 1e-9
"""A squared distance above the squared radius by this factor is no contact, whatever was rounded on the way."""

WELL_CLEAR = 1.1
"""The same where digits were lost."""


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
    strained: bool,
) -> LaneResult:
    """`overlap` within its bounds, and exact where the solid's surface does not reach the sphere.

    `nearest_2` is the squared distance (m²) of the surface from the sphere's centre, `lowest` the least signed
    distance (m) of the centre below the faces' planes, positive inside, `reference_2` the squared distance (m²) of the
    reference point, `farthest` (m) that of the farthest corner, `extent` (m) the length of the longest edge; `strained`
    means that digits were lost on the way.
    """
    # Every choice is between values that have been worked out, so that it becomes an instruction and no branch.
    volume, gradient, area = overlap
    whole, whole_area = sphere_volume(radius), sphere_area(radius)
    # Inside, it is at least the radius, and outside at most 0: rounding cannot take one for the other.
    engulfed = (lowest > 0.5 * radius) & (solid_volume > 0.0)
    uncut_volume, uncut_area = whole if engulfed else 0.0, whole_area if engulfed else 0.0
    clear = WELL_CLEAR if strained else CLEAR
    apart = (nearest_2 > clear * (radius * radius)) | (solid_volume == 0.0)
    bounded_volume = min(max(volume, 0.0), whole, solid_volume)
    bounded_area = min(max(area, 0.0), whole_area)
    # The error of a solid smaller than the sphere is smaller, too.
    tiny = TINY * whole * min(extent, radius)
    doubtful = (reference_2 > FARTHEST_REFERENCE**2 * (radius * radius)) | (bounded_volume * radius < tiny) | strained
    # What overflowed on the way is no number, and compares as neither more nor less.
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
