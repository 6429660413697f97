"""Volume that a union of balls shares with a solid, by a count of points: slow, and independent of the product."""

from collections.abc import Callable

import numpy as np

from common.arrays import BoolArray, FloatArray


def voxel_volume_m3(
    spheres: FloatArray, inside: Callable[[FloatArray], BoolArray], step_m: float, reach: FloatArray | None = None
) -> float:
    """Return the volume in m³ of the middles of voxels within a sphere (m, 4) and inside the solid, slice by slice.

    inside: tells of points (n, 3) whether they are in the solid. step_m: edge of a voxel. reach (2, 3): corners of a
    box around the solid, outside which nothing is counted.
    """
    low, high = (spheres[:, :3] - spheres[:, 3:]).min(axis=0), (spheres[:, :3] + spheres[:, 3:]).max(axis=0)
    if reach is not None:
        low, high = np.maximum(low, reach[0]), np.minimum(high, reach[1])
    if not (low < high).all():
        return 0.0
    x, y, z = (np.arange(low[k] + 0.5 * step_m, high[k], step_m) for k in range(3))
    count = 0
    for level in z:
        squares = spheres[:, 3] ** 2 - (level - spheres[:, 2]) ** 2
        covered = np.zeros((len(x), len(y)), dtype=np.bool_)
        for (at_x, at_y), square in zip(spheres[squares > 0.0, :2], squares[squares > 0.0], strict=True):
            wide = square**0.5
            across, up = (slice(*np.searchsorted(row, (at - wide, at + wide))) for row, at in ((x, at_x), (y, at_y)))
            covered[across, up] |= (x[across, None] - at_x) ** 2 + (y[None, up] - at_y) ** 2 <= square
        i, k = covered.nonzero()
        count += int(np.count_nonzero(inside(np.column_stack([x[i], y[k], np.full(len(i), level)]))))
    return count * step_m**3
