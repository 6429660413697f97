"""Common layout of the kinds: their numbers, and a row of 15 numbers for the shape of each."""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import BOOL, FLOAT64, INT64, inlined, input_array, output_array, tuple_type
from robot_side.compiled.vectors import Vector
from robot_side.overlap.closed_forms.solid import sphere_volume

SPHERE: Final = 0
BOX: Final = 1
TETRAHEDRON: Final = 2
HALF_SPACE: Final = 3
MESH: Final = 4
"""A mesh has the layout of the box around it. Contact and overlap come from `placed_meshes`, by address."""
SHAPE_NUMBERS: Final = 15
"""Numbers of a primitive in a table"""
NUMBERS: Final = 20
"""Numbers of a primitive in a frame: the values of its arrays, for a mesh also its sizes from the library"""
VELOCITY: Final = 12
"""Index of the velocity in an object's numbers, after position and rotation"""

Nearest = tuple[float, Vector]
"""Signed distance, positive outside, and the unit vector along which it falls fastest: towards the nearest point from
outside, away from it from inside, the same on both sides of a face."""
Contact = tuple[float, float]
"""Distance along û at which a moving sphere first touches, and û·n of the contact plane. 0 and 1 if it overlaps
already; infinite and 0 without contact, or beyond a given reach."""
NEVER: Final[Contact] = (math.inf, 0.0)
ANY_DIRECTION: Final = (0.0, 0.0, 1.0)
"""Direction for a point that is equally far in all directions"""


def rows(*columns: FloatArray, width: int = SHAPE_NUMBERS) -> FloatArray:
    """Return shapes (k, width) from consecutive columns (k, ...), the rest 0."""
    count = len(columns[0])
    flat = [column.reshape(count, math.prod(column.shape[1:])) for column in columns]
    used = sum(column.shape[1] for column in flat)
    return np.concatenate([*flat, np.zeros((count, width - used))], axis=1)


OVERLAP: Final[tuple[Any, ...]] = (
    *(input_array(2), INT64, FLOAT64, FLOAT64, FLOAT64, FLOAT64, BUNDLE, output_array(1)),
)
"""Argument types of an overlap kernel: shapes (n, 15), the row, the sphere's centre and radius, the scene's meshes, and
an output (3,) for dV/dcentre. It returns V."""
CONTACT: Final[tuple[Any, ...]] = (BUNDLE, INT64, *(FLOAT64,) * 8, BOOL)
"""Argument types of the contact kernel of meshes (see `placed_meshes`)"""
MESH_CONTACT: Final[Any] = tuple_type(FLOAT64, FLOAT64)
"""Return type of the contact kernel of meshes: a `Contact`"""
TOUCHING_M: Final = 1e-7
"""Largest gap and depth at which bodies touch: they do not overlap yet, and may begin to."""
LEAST_CONTACT_M: Final = 1e-12
"""Contact distance of bodies that touch already; 0 is that of bodies that overlap."""
CLOSING: Final = 1e-9
"""Least û·n of an approach: below it a surface is beside the path and does not come nearer."""
MOST_STEPS: Final = 60
ENLARGED: Final = 1.0 + 1e-9
"""Factor on bounds around meshes, so that rounding never misses a contact"""


@inlined
def way_by(part: float) -> float:
    """Return 1 / part: the distance along the path for a metre along an axis, at most 1e15 m."""
    return 1.0 / part if abs(part) > 1e-15 else 1e15


@inlined
def posed(position: Vector, turns: FloatArray, k: int, x: float, y: float, z: float) -> Vector:
    """Return the point (x, y, z) of a frame at this pose in world coordinates; turns (g, 9) by rows."""
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
def to_metres(volume: float, gradient: Vector, size: float, radius: float, overlap_gradient: FloatArray) -> float:
    """Convert an overlap from units of `size` to metres; after an overflow, the whole sphere, which warns early."""
    area = size * size
    if not math.isfinite(volume + gradient[0] + gradient[1] + gradient[2]):
        overlap_gradient[0] = overlap_gradient[1] = overlap_gradient[2] = 0.0
        return sphere_volume(radius)
    overlap_gradient[0], overlap_gradient[1], overlap_gradient[2] = (
        gradient[0] * area,
        gradient[1] * area,
        gradient[2] * area,
    )
    return volume * area * size
