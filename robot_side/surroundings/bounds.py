"""Bounding spheres of primitives, objects and blocks, and a test whether a swept sphere touches one (broad phase)."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load, scale, subtract
from robot_side.surroundings.kinds.layout import lengths

_ENLARGED: Final = 1.0 + 1e-9
"""Bounds are enlarged by this factor, so that rounding never passes over a contact."""


@inlined
def passes(center: Vector, along: Vector, reach: float, bounds: FloatArray, row: int, radius: float) -> bool:
    """Return whether a sphere swept by `reach` along the unit vector `along` touches the bounding sphere in `row`."""
    if not bounds[row, 3] >= 0.0:
        return False
    offset = subtract(load(bounds, row), center)
    part = min(max(dot(offset, along), 0.0), reach)
    apart = subtract(offset, scale(part, along))
    most: float = (bounds[row, 3] + radius) * _ENLARGED
    return dot(apart, apart) <= most * most


def around(bounds: FloatArray, starts: IntArray) -> FloatArray:
    """Return for each group a sphere (g, 4) around its bounding spheres `bounds` (n, 4): centres and radii.

    Group k has the rows from starts[k] up to starts[k + 1]; `starts` (g + 1,) ends with n. The radius is -inf without
    rows, and inf if one of the bounding spheres is infinite.
    """
    sizes = starts[1:] - starts[:-1]
    found = np.zeros((len(sizes), 4))
    found[:, 3] = -math.inf
    alone, several = (sizes == 1).nonzero()[0], (sizes > 1).nonzero()[0]
    found[alone] = bounds[starts[alone]]
    if len(several) == 0:
        return found
    sizes, own = sizes[several], bounds[(sizes != 1).repeat(sizes)]
    first, centers, radii = sizes.cumsum() - sizes, own[:, :3], own[:, 3]
    low = np.minimum.reduceat(centers - radii[:, None], first)
    high = np.maximum.reduceat(centers + radii[:, None], first)
    ends = high[:, :1] < math.inf
    middles = 0.5 * (np.where(ends, low, 0.0) + np.where(ends, high, 0.0))
    found[several, :3] = middles
    found[several, 3] = np.maximum.reduceat(lengths(centers - middles.repeat(sizes, axis=0)) + radii, first)
    return found
