"""Search for the mirror planes of a solid."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from common.arrays import FloatArray

_SAME_M = 5e-5
"""Tolerance of a mirror symmetry, in m: allows for rounded vertices of a drawn solid."""


def mirror_images(
    points_m: FloatArray, depth_m: Callable[[FloatArray], FloatArray], frames: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return the origin (3,) of the mirror planes, and maps (g, 3, 3), identity first, that mirror a solid to itself.

    points_m (p, 3) are on the surface; `depth_m` returns the depth of points. Candidate planes are normal to the axes
    of each of the `frames` (3, 3), or to the points' principal axes. The frame with the most mirror planes is used.
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
            # An image inside the solid is the solid itself, as a mirror preserves volume.
            if depth_m((points_m - origin) @ mirror + origin).min() >= -_SAME_M:
                mirrors.append(mirror)
        if 2 ** len(mirrors) > len(best):
            combined = itertools.product(*((np.eye(3), mirror) for mirror in mirrors))
            best_origin = origin
            best = [np.linalg.multi_dot([np.eye(3), np.eye(3), *several]) for several in combined]
    return best_origin, np.array(best)
