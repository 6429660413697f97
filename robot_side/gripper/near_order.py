"""Spheres in an order in which those that follow each other are near each other."""

import numpy as np

from common.arrays import FloatArray, IntArray


def near_order(centers_m: FloatArray, size: int) -> IntArray:
    """An order (m,) of points (m, 3) in which each run of `size` lies close together.

    The points are halved across their longest extent, again and again, so that all runs but the last are whole.
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
