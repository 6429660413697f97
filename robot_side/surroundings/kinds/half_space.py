"""Half-spaces, solid where normal·x <= offset. Numbers of a half-space: normal (3), offset."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load, negative
from robot_side.overlap.solids.half_space import cap
from robot_side.overlap.solids.solid import Overlap
from robot_side.surroundings.kinds.kind import Array, Check, Kind, Placed
from robot_side.surroundings.kinds.layout import (
    CLOSING,
    LEAST_CONTACT_M,
    NEVER,
    NUMBERS,
    SHAPE_NUMBERS,
    TOUCHING_M,
    WHOLE,
    Chord,
    Contact,
    Nearest,
    around,
    cut_chord,
    rows,
)


def place(numbers: FloatArray) -> Placed:
    """Return the half-spaces (k) with these numbers (k, 20); bounds and volumes are infinite."""
    infinite = np.full(len(numbers), math.inf)
    return Placed(numbers[:, :SHAPE_NUMBERS], around(np.zeros((len(numbers), 3)), infinite), infinite)


def placed(_sizes: FloatArray, positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return the numbers of the half-spaces below planes at these poses; a plane's normal is its pose's third axis."""
    normals = rotations[:, :, 2]
    return rows(normals, (normals * positions).sum(axis=1), width=NUMBERS)


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
def chord(shapes: FloatArray, row: int, start: Vector, along: Vector) -> Chord:
    """Return the chord of a line from `start` along the unit vector `along` in the half-space in `row`."""
    normal = load(shapes, row)
    return cut_chord(WHOLE, dot(normal, start) - shapes[row, 3], dot(normal, along))


@inlined
def overlap(shapes: FloatArray, row: int, center: Vector, radius: float) -> Overlap:
    """Return the overlap of a sphere with the half-space in `row` (eq. 12)."""
    normal = shapes[row, 0], shapes[row, 1], shapes[row, 2]
    height = dot(normal, center) - shapes[row, 3]
    return cap(radius - height, radius + height, radius, normal)


KIND: Final = Kind(
    "half_space",
    (Array("half_space_normals", (3,), Check.UNIT), Array("half_space_offsets_m", ())),
    placed=placed,
    place=place,
    nearest=nearest,
    contact=contact,
    chord=chord,
    overlap=overlap,
)
