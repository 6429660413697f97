"""Half-spaces, solid where normal·x <= offset. Numbers of a half-space: normal (3), offset."""

import math
from typing import Final

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, negative
from robot_side.overlap.solids.half_space import half_space_overlap
from robot_side.overlap.solids.solid import Overlap
from robot_side.surroundings.kinds.kind import Array, Check, Kind
from robot_side.surroundings.kinds.layout import CLOSING, LEAST_CONTACT_M, NEVER, TOUCHING_M, Contact, Nearest


@inlined
def place(_numbers: FloatArray, _k: int, bounds: FloatArray, row: int) -> float:
    """Write the bounding sphere of one half-space, of infinite radius; return its volume, infinity."""
    for axis in range(3):
        bounds[row, axis] = 0.0
    bounds[row, 3] = math.inf
    return math.inf


@inlined
def placed(
    _sizes: FloatArray, _k: int, position: Vector, turns: FloatArray, turn: int, numbers: FloatArray, row: int
) -> None:
    """Write the numbers of the half-space below a plane at this pose; the plane's normal is the pose's third axis."""
    normal = turns[turn, 2], turns[turn, 5], turns[turn, 8]
    for axis in range(3):
        numbers[row, axis] = normal[axis]
    numbers[row, 3] = dot(normal, position)


@inlined
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """Return signed distance and direction from `point` to the plane in `row` (see `Nearest`)."""
    normal = shapes[row, 0], shapes[row, 1], shapes[row, 2]
    return dot(normal, point) - shapes[row, 3], negative(normal)


@inlined
def contact(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, _reach: float) -> Contact:
    """Return the contact with the half-space in `row` of a sphere that moves along the unit vector `along`."""
    normal = shapes[row, 0], shapes[row, 1], shapes[row, 2]
    gap, closing = dot(normal, start) - shapes[row, 3] - radius, -dot(normal, along)
    if gap < -TOUCHING_M:
        return 0.0, 1.0
    return (max(gap / closing, LEAST_CONTACT_M), closing) if closing > CLOSING else NEVER


@inlined
def overlap(shapes: FloatArray, row: int, center: Vector, radius: float) -> Overlap:
    """Return the exact overlap of a sphere with the half-space in `row` (eq. 12)."""
    return half_space_overlap(center, radius, (shapes[row, 0], shapes[row, 1], shapes[row, 2]), shapes[row, 3])


KIND: Final = Kind(
    "half_space",
    (Array("half_space_normals", (3,), Check.UNIT), Array("half_space_offsets_m", ())),
    placed=placed,
    place=place,
    nearest=nearest,
    contact=contact,
    overlap=overlap,
)
