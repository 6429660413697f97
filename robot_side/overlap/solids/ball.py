"""Overlap of two spheres (eq. 11)."""

import math

from robot_side.compiled.kernel import building_block
from robot_side.compiled.vectors import Vector, scale
from robot_side.overlap.digits.double_double import minus, plus, rounded, square_root, times, two_sum
from robot_side.overlap.solids.solid import Overlap, bounded, nothing, sphere_volume, whole_solid, whole_sphere


@building_block
def sphere_overlap(center: Vector, radius: float, other_center: Vector, other_radius: float) -> Overlap:
    """Return the overlap of the sphere (`center`, `radius`) with another one, a lens; all in m.

    The lens's volume is a sum of positive terms only. They are computed from gaps between the surfaces, differences of
    lengths in double-double: the depth `overlap`, and the distances by which the smaller sphere protrudes. So the
    volume has a small relative error at every depth. Spheres that touch, inside or outside, give the limit exactly. Of
    two equal spheres at the same place, the first counts as lying within the second.
    """
    x = two_sum(other_center[0], -center[0])
    y = two_sum(other_center[1], -center[1])
    z = two_sum(other_center[2], -center[2])
    toward = x[0], y[0], z[0]
    precise_distance = square_root(plus(plus(times(x, x), times(y, y)), times(z, z)))
    distance = precise_distance[0]
    large, small = max(radius, other_radius), min(radius, other_radius)
    # Distance of the smaller sphere's centre beyond the larger one's surface.
    beyond = minus(precise_distance, (large, 0.0))
    overlap, sticking_out = rounded(minus((small, 0.0), beyond)), rounded(plus((small, 0.0), beyond))
    if overlap <= 0.0 or small == 0.0:
        return nothing()
    if sticking_out <= 0.0:
        if radius <= other_radius:
            return whole_sphere(radius)
        return whole_solid(sphere_volume(other_radius))

    depth_term = sticking_out * (distance + 3.0 * large + small) + 4.0 * (large - small) * small
    volume = math.pi * overlap * overlap * depth_term / (12.0 * distance)
    # Heron's formula gives the circle in which the spheres meet.
    disc = math.pi * overlap * sticking_out * (distance + large + small) * (distance + large - small)
    disc /= 4.0 * distance * distance
    far_gap = sticking_out if radius >= other_radius else distance + (other_radius - radius)
    area = math.pi * radius * overlap * far_gap / distance
    return bounded((volume, scale(disc / distance, toward), area), radius, sphere_volume(other_radius))
