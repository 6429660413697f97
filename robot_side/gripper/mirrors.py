"""Planes in which a solid is its own mirror image."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from common.arrays import FloatArray

_SAME_M = 5e-5
"""A solid out of a drawing is as symmetric as its vertices were rounded."""


def mirror_images(
    points_m: FloatArray, depth_m: Callable[[FloatArray], FloatArray], frames: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """(origin (3,), images (g, 3, 3)): mirrors through the origin, the identity first, that leave a solid as it is.

    points_m (p, 3) are on its surface, `depth_m` says how deep points are. The planes are sought across the axes of
    `frames` (3, 3), and across the points' own principal axes; of all frames, that with the most planes counts.
    """
    middle = 0.5 * (points_m.min(axis=0) + points_m.max(axis=0))
    principal = np.linalg.eigh(np.cov(points_m.T))[1]
    best_origin, best = middle, [np.eye(3)]
    for frame in (*frames, principal):
        local = points_m @ frame
        origin = frame @ (0.5 * (local.min(axis=0) + local.max(axis=0)))
        mirrors = []
        for axis in frame.T:
            mirror = np.eye(3) - 2.0 * np.outer(axis, axis)
            # Mirrored into itself it is its own image, as a mirror keeps volumes.
            if depth_m((points_m - origin) @ mirror + origin).min() >= -_SAME_M:
                mirrors.append(mirror)
        if 2 ** len(mirrors) > len(best):
            combined = itertools.product(*((np.eye(3), mirror) for mirror in mirrors))
            best_origin = origin
            best = [np.linalg.multi_dot([np.eye(3), np.eye(3), *several]) for several in combined]
    return best_origin, np.array(best)
