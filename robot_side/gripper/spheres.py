"""Cover a gripper's boxes with spheres: the volume that is enlarged and overlapped (§4.1)."""

import heapq
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class SphereCover:
    """Spheres whose union contains every box that they were made for, in the boxes' common or own frames."""

    centers_m: FloatArray
    """(m, 3) each in the frame that its box was given in"""
    radii_m: FloatArray
    """(m,)"""
    box: IntArray
    """(m,) the index of the box that a sphere covers a part of"""


def cover_boxes(centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray, count: int = 16) -> SphereCover:
    """Cover oriented boxes with `count` spheres, each circumscribed to one cell of a box.

    centers_m (k, 3), rotations (k, 3, 3) box to frame, half_sizes_m (k, 3). The cell with the largest sphere is
    halved across its longest edge until there are `count` cells. Where there are more boxes than that, each
    gets the one sphere that it needs. The spheres are in a fixed order for the same boxes.
    ValueError for no box, a wrong shape, a negative or non-finite value, or a count below 1.
    """
    boxes = centers_m.shape[0] if centers_m.ndim == 2 else 0
    for name, values, shape in (
        ("centers_m", centers_m, (boxes, 3)),
        ("rotations", rotations, (boxes, 3, 3)),
        ("half_sizes_m", half_sizes_m, (boxes, 3)),
    ):
        if boxes == 0 or values.shape != shape:
            raise ValueError(f"{name} has the shape {values.shape}; valid: one row for each of 1 or more boxes")
        if not np.isfinite(values).all():
            raise ValueError(f"{name} holds NaN or infinity; valid: finite numbers")
    if (half_sizes_m < 0.0).any():
        raise ValueError(f"half_sizes_m = {half_sizes_m.min()} is negative; valid: 0 or more")
    if count < 1:
        raise ValueError(f"count = {count}; valid: 1 or more")

    # The heap's order is by radius, then by age, which makes ties between equal cells repeatable.
    cells = [(-float(np.linalg.norm(half)), index, index, np.zeros(3), half) for index, half in enumerate(half_sizes_m)]
    heapq.heapify(cells)
    age = boxes
    while len(cells) < count and cells[0][0] < 0.0:
        _, _, box, offset, half = heapq.heappop(cells)
        axis = int(np.argmax(half))
        smaller = half.copy()
        smaller[axis] /= 2.0
        for side in (-1.0, 1.0):
            shifted = offset.copy()
            shifted[axis] += side * smaller[axis]
            heapq.heappush(cells, (-float(np.linalg.norm(smaller)), age, box, shifted, smaller))
            age += 1

    cells.sort(key=lambda cell: (cell[2], *cell[3]))
    box_of_cell = np.array([cell[2] for cell in cells], dtype=np.int64)
    offsets = np.array([cell[3] for cell in cells])
    placed = centers_m[box_of_cell] + np.einsum("mij,mj->mi", rotations[box_of_cell], offsets)
    # Rounding must not leave a corner just outside.
    radii = np.array([-cell[0] for cell in cells]) * (1.0 + 1e-12)
    return SphereCover(centers_m=placed, radii_m=radii, box=box_of_cell)
