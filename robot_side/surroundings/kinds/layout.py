"""What the kinds share: their numbers, and a row of 15 numbers for the shape of any of them."""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import COUNT, NUMBER, TRUTH, inlined, input_array, output_array, together
from robot_side.compiled.vectors import Vector
from robot_side.overlap.closed_forms.solid import sphere_volume

SPHERE: Final = 0
BOX: Final = 1
TETRAHEDRON: Final = 2
HALF_SPACE: Final = 3
MESH: Final = 4
"""A mesh has the layout of the box around it. Contact and overlap come from `placed_meshes`, by address."""
SHAPE_NUMBERS: Final = 15
"""Of a primitive as a table has it"""
NUMBERS: Final = 20
"""Of a primitive as a frame has it: the values of its arrays, and of a mesh what its library says of it."""
VELOCITY: Final = 12
"""Among the numbers of an object, its velocity follows its position and rotation."""

Nearest = tuple[float, Vector]
"""Signed distance, positive outside, and the unit vector along which it falls fastest: towards the nearest point from
outside, away from it from inside, the same on both sides of a face."""
Contact = tuple[float, float]
"""The distance along û at which a moving sphere first touches, and û·n of the plane in which it does so: 0 and 1 where
it overlaps already; infinite and 0 for never, or beyond a given reach."""
NEVER: Final[Contact] = (math.inf, 0.0)
ANY_DIRECTION: Final = (0.0, 0.0, 1.0)
"""For a point from which every way is as long."""


def rows(*columns: FloatArray, width: int = SHAPE_NUMBERS) -> FloatArray:
    """Shapes (k, 15) from columns (k, ...) that follow each other, the rest 0."""
    count = len(columns[0])
    flat = [column.reshape(count, math.prod(column.shape[1:])) for column in columns]
    used = sum(column.shape[1] for column in flat)
    return np.concatenate([*flat, np.zeros((count, width - used))], axis=1)


OVERLAP: Final[tuple[Any, ...]] = (*(input_array(2), COUNT, NUMBER, NUMBER, NUMBER, NUMBER, BUNDLE, output_array(1)),)
"""What a kernel of overlaps takes: shapes (n, 15), the row, the sphere's centre and radius, the scene's meshes, and
room (3,) for dV/dcentre. It returns V."""
CONTACT: Final[tuple[Any, ...]] = (BUNDLE, COUNT, *(NUMBER,) * 8, TRUTH)
"""What a kernel of contacts with meshes takes (see `placed_meshes`)."""
MESH_CONTACT: Final[Any] = together(NUMBER, NUMBER)
"""And returns: a `Contact`."""
TOUCHING_M: Final = 1e-7
"""What is no farther off, and no deeper, than this touches: it overlaps by nothing yet, and may go on to do so."""
LEAST_WAY_M: Final = 1e-12
"""The way to what is touched already; 0 is that to what overlaps."""
CLOSING: Final = 1e-9
"""Slower than this share of the way, what is beside does not come nearer."""
MOST_STEPS: Final = 60
ENLARGED: Final = 1.0 + 1e-9
"""Bounds around meshes are enlarged by this, so that rounding never passes over what is touched."""


@inlined
def way_by(part: float) -> float:
    """The way on which what moves by `part` of it moves by a metre, at most 1e15 m."""
    return 1.0 / part if abs(part) > 1e-15 else 1e15


@inlined
def posed(position: Vector, turns: FloatArray, k: int, x: float, y: float, z: float) -> Vector:
    """The point (x, y, z) of an own frame in the world; turns (g, 9) by rows."""
    return (
        position[0] + (turns[k, 0] * x + turns[k, 1] * y + turns[k, 2] * z),
        position[1] + (turns[k, 3] * x + turns[k, 4] * y + turns[k, 5] * z),
        position[2] + (turns[k, 6] * x + turns[k, 7] * y + turns[k, 8] * z),
    )


@inlined
def write_pose(position: Vector, turns: FloatArray, k: int, numbers: FloatArray, row: int) -> None:
    """Write a position, and a rotation of turns (g, 9), as the first twelve numbers."""
    for axis in range(3):
        numbers[row, axis] = position[axis]
    for entry in range(9):
        numbers[row, 3 + entry] = turns[k, entry]


@inlined
def take_over(volume: float, gradient: Vector, size: float, radius: float, push: FloatArray) -> float:
    """Take over what was found in units of `size`; the whole sphere where the numbers overflowed, which is early."""
    area = size * size
    if not math.isfinite(volume + gradient[0] + gradient[1] + gradient[2]):
        push[0] = push[1] = push[2] = 0.0
        return sphere_volume(radius)
    push[0], push[1], push[2] = gradient[0] * area, gradient[1] * area, gradient[2] * area
    return volume * area * size
