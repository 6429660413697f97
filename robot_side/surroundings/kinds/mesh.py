"""Closed meshes.

A table's row describes the box around a mesh; kernels of `placed_meshes` compute contact and overlap.
"""

from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load, subtract
from robot_side.surroundings.kinds import box
from robot_side.surroundings.kinds.kind import Array, Check, Kind, Placed
from robot_side.surroundings.kinds.layout import (
    ENLARGED,
    NEVER,
    NUMBERS,
    SHAPE_NUMBERS,
    TOUCHING_M,
    Contact,
    around,
    posed,
    rows,
    way_by,
)


def place(numbers: FloatArray) -> Placed:
    """Return the meshes (k) with these numbers (k, 20), in the layout of the boxes around them."""
    middles = posed(numbers[:, :3], numbers[:, 3:12].reshape(-1, 3, 3), numbers[:, 15:18])
    shapes = np.concatenate([middles, numbers[:, 3:SHAPE_NUMBERS]], axis=1)
    return Placed(shapes, around(middles, numbers[:, 18]), numbers[:, 19])


def placed(sizes: FloatArray, positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return the numbers of meshes at these poses. sizes: the 8 numbers that follow the pose (see `of_library`)."""
    return rows(positions, rotations, sizes[:, :8], width=NUMBERS)


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
    chord=box.chord,
    in_box=True,
    derive=_derive,
    more=lambda objects: of_library(objects.mesh_library, objects.mesh_index),
)
