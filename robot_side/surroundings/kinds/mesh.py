"""Closed meshes.

A table's row describes the box around a mesh; kernels of `placed_meshes` compute contact and overlap.
"""

from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load, subtract
from robot_side.surroundings.kinds import box
from robot_side.surroundings.kinds.kind import Array, Check, Kind
from robot_side.surroundings.kinds.layout import ENLARGED, NEVER, NUMBERS, TOUCHING_M, Contact, way_by, write_pose


@inlined
def place(numbers: FloatArray, k: int, bounds: FloatArray, row: int) -> float:
    """Convert a mesh's numbers to those of the box around it, and write its bounding sphere; return its volume (m³)."""
    x, y, z = numbers[k, 0], numbers[k, 1], numbers[k, 2]
    for axis in range(3):
        first = 3 + 3 * axis
        u, v, w = numbers[k, first], numbers[k, first + 1], numbers[k, first + 2]
        middle = u * numbers[k, 15] + v * numbers[k, 16] + w * numbers[k, 17]
        bounds[row, axis] = (x if axis == 0 else y if axis == 1 else z) + middle
    for axis in range(3):
        numbers[k, axis] = bounds[row, axis]
    bounds[row, 3] = numbers[k, 18]
    return float(numbers[k, 19])


@inlined
def placed(
    sizes: FloatArray, k: int, position: Vector, turns: FloatArray, turn: int, numbers: FloatArray, row: int
) -> None:
    """Write the numbers of a mesh at this pose. sizes: the 8 numbers that follow the pose (see `of_library`)."""
    write_pose(position, turns, turn, numbers, row)
    for entry in range(12, NUMBERS):
        numbers[row, entry] = sizes[k, entry - 12]


def of_library(library: Any, index: IntArray) -> FloatArray:
    """Return for each mesh (q, 8): half sizes and middle of its bounding box, radius of its bounding sphere, volume.

    index (q,): of each mesh in the library.
    """
    if library is None:
        return np.empty((0, 8))
    around = library.bounds
    columns = around.half_sizes_m, around.middles_m, around.radii_m[:, None], library.tables.volumes[:, None]
    return np.concatenate([column[index] for column in columns], axis=1)


@inlined
def contact(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float) -> Contact:
    """Return where a sphere enters the box around a mesh, enlarged by the radius.

    It touches the mesh there or later.
    """
    enter, leave, grown = 0.0, reach, radius * ENLARGED + TOUCHING_M
    offset = subtract(start, load(shapes, row))
    for k in range(3):
        axis = shapes[row, 3 + k], shapes[row, 6 + k], shapes[row, 9 + k]
        place, by, half = dot(axis, offset), way_by(dot(axis, along)), shapes[row, 12 + k] + grown
        first, last = (-half - place) * by, (half - place) * by
        enter, leave = max(enter, min(first, last)), min(leave, max(first, last))
    return (enter, 0.0) if enter <= leave else NEVER


def _derive(objects: Any) -> tuple[FloatArray, ...]:
    """Return middles, rotations and half sizes of the boxes around a frame's meshes."""
    library, index = objects.mesh_library, objects.mesh_index
    if library is None:
        return objects.mesh_positions_m, objects.mesh_rotations, np.empty((0, 3))
    middles_m = library.placed_middles_m(index, objects.mesh_positions_m, objects.mesh_rotations)
    return middles_m, objects.mesh_rotations, library.bounds.half_sizes_m.take(index, axis=0)


KIND: Final = Kind(
    "mesh",
    (
        Array("mesh_index", (), Check.INDEX),
        Array("mesh_positions_m", (3,)),
        Array("mesh_rotations", (3, 3), Check.ORTHONORMAL),
    ),
    placed=placed,
    place=place,
    nearest=box.nearest,
    contact=contact,
    in_box=True,
    derive=_derive,
    more=lambda objects: of_library(objects.mesh_library, objects.mesh_index),
)
