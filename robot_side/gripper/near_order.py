"""Order of spheres in which consecutive spheres are near each other."""

import numpy as np

from common.arrays import FloatArray, IntArray


def near_order(centers_m: FloatArray, size: int) -> IntArray:
    """Return an order (m,) of points (m, 3) in which each run of `size` consecutive points is close together.

    The points are halved recursively across their longest extent, in such a way that all runs but the last are full.
    """
    order = np.arange(len(centers_m))
    waiting = [(0, len(order))]
    while waiting:
        first, end = waiting.pop()
        if end - first <= size:
            continue
        part = order[first:end]
        axis = int(np.argmax(np.ptp(centers_m[part], axis=0)))
        order[first:end] = part[np.argsort(centers_m[part, axis], kind="stable")]
        half = first + size * max(1, round((end - first) / (2 * size)))
        waiting += [(first, half), (half, end)]
    return order
