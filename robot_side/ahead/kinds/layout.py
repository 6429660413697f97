"""What the kinds share: their numbers, and a row of 15 numbers for the shape of any of them."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.vectors import Vector

SPHERE: Final = 0
BOX: Final = 1
TETRAHEDRON: Final = 2
HALF_SPACE: Final = 3
MESH: Final = 4
"""A mesh has the layout of the box around it: the mesh itself lies in the library, and its ways and overlaps come from
array functions."""
SHAPE_NUMBERS: Final = 15

Nearest = tuple[float, Vector]
"""Signed distance, positive outside, and the unit vector along which it falls fastest: towards the nearest point from
outside, away from it from inside, the same on both sides of a face."""
ANY_DIRECTION: Final = (0.0, 0.0, 1.0)
"""For a point from which every way is as long."""


def rows(*columns: FloatArray) -> FloatArray:
    """Shapes (k, 15) from columns (k, ...) that follow each other, the rest 0."""
    count = len(columns[0])
    flat = [column.reshape(count, math.prod(column.shape[1:])) for column in columns]
    used = sum(column.shape[1] for column in flat)
    return np.concatenate([*flat, np.zeros((count, SHAPE_NUMBERS - used))], axis=1)


TOUCHING_M: Final = 1e-7
"""What is no farther off, and no deeper, than this touches: it overlaps by nothing yet, and may go on to do so."""
LEAST_WAY_M: Final = 1e-12
"""The way to what is touched already; 0 is that to what overlaps."""
CLOSING: Final = 1e-9
"""Slower than this share of the way, what is beside does not come nearer."""
MOST_STEPS: Final = 60
