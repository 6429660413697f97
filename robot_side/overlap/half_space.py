"""One sphere and one half-space (eq. 11): the sphere's cap, V_c of eq. 12."""

import math

from robot_side.overlap.compile import building_block
from robot_side.overlap.solid import Overlap, bounded, nothing, whole_sphere
from robot_side.overlap.vectors import Vector, dot, norm, scale


@building_block
def half_space_overlap(center: Vector, radius: float, normal: Vector, offset: float) -> Overlap:
    """The cap of the sphere (`center`, `radius`) within {x: normal·x <= offset}; lengths in m.

    `normal` may have any length but 0; the set is the one that the inequality describes.
    """
    length = norm(normal)
    height = (dot(normal, center) - offset) / length
    depth, rest = radius - height, radius + height
    if depth <= 0.0 or radius == 0.0:
        return nothing()
    if rest <= 0.0:
        return whole_sphere(radius)
    volume = math.pi * depth * depth * (radius + rest) / 3.0
    disc = math.pi * (depth * rest)
    overlap = volume, scale(-disc / length, normal), 2.0 * math.pi * radius * depth
    return bounded(overlap, radius, math.inf)
