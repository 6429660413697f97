"""Cover of a capsule by a row of spheres along its axis. A ball is a capsule of length 0, which covers itself."""

import math

import numpy as np

from common.arrays import FloatArray


def cover_capsule(
    radius_m: float, half_length_m: float, stand_out_m: float, most: int = 2000
) -> tuple[FloatArray, FloatArray, float]:
    """Return centres (m, 3) and radii (m,) of the spheres, and the distance by which they protrude from the capsule.

    The capsule's axis goes from -half_length_m to half_length_m on the z axis; the first and the last sphere are
    centred at its ends. Neighbouring spheres intersect at the capsule's surface. If more than `most` spheres would be
    needed, `most` spheres protrude farther than `stand_out_m`.
    """
    if half_length_m <= 0.0:
        return np.zeros((1, 3)), np.array([radius_m]), 0.0
    # Two spheres of radius r + s that meet at r are 2 √(2 r s + s²) apart.
    reach_m = math.sqrt(2.0 * radius_m * stand_out_m + stand_out_m**2)
    count = min(1 + math.ceil(half_length_m / reach_m), most)
    half_step_m = half_length_m / (count - 1)
    needed_m = math.sqrt(radius_m**2 + half_step_m**2) * (1.0 + 1e-12) - radius_m
    centers = np.zeros((count, 3))
    centers[:, 2] = half_step_m * np.arange(1 - count, count, 2)
    return centers, np.full(count, radius_m + needed_m), needed_m
