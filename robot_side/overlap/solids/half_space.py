"""Overlap of a sphere and a half-space (eq. 11): the sphere's cap, V_c of eq. 12."""

import math

from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, scale
from robot_side.overlap.digits.double_double import divided, minus, multiple, plus, rounded, square_root, two_product
from robot_side.overlap.solids.solid import Overlap, bounded, nothing, whole_sphere


@building_block
def half_space_overlap(center: Vector, radius: float, normal: Vector, offset: float) -> Overlap:
    """Return the cap of the sphere (`center`, `radius`) within {x: normal·x <= offset}; lengths in m.

    `normal` may have any length but 0. The result has a small relative error at every depth. The plane's distance is a
    small difference of large products, so it is computed in double-double.
    """
    x, y, z = center
    a, b, c = normal
    length = square_root(plus(plus(two_product(a, a), two_product(b, b)), two_product(c, c)))
    product = plus(plus(two_product(a, x), two_product(b, y)), two_product(c, z))
    # The height of the centre above the plane, and the radius, times the normal's length.
    height, reach = minus(product, (offset, 0.0)), multiple(radius, length)
    depth, rest = rounded(divided(minus(reach, height), length)), rounded(divided(plus(reach, height), length))
    return cap(depth, rest, radius, scale(1.0 / length[0], normal))


@inlined
def cap(depth: float, rest: float, radius: float, normal: Vector) -> Overlap:
    """Return the cap of height `depth` of a sphere; `rest` = 2 `radius` - `depth`. All are in m.

    `rest` is an argument because it keeps its relative accuracy where the cap is nearly the whole sphere. `normal` is
    the unit vector across the cap's flat side, pointing out of the solid.
    """
    if depth <= 0.0 or radius == 0.0:
        return nothing()
    if rest <= 0.0:
        return whole_sphere(radius)
    volume = math.pi * depth * depth * (radius + rest) / 3.0
    disc = math.pi * (depth * rest)
    overlap = volume, scale(-disc, normal), 2.0 * math.pi * radius * depth
    return bounded(overlap, radius, math.inf)
