"""Closed meshes as a kind: rows of the boxes around them; contact and overlap come from `placed_meshes`, by address."""

from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load, subtract
from robot_side.surroundings.kinds import box
from robot_side.surroundings.kinds.kind import Array, Check, Kind
from robot_side.surroundings.kinds.layout import ENLARGED, NEVER, TOUCHING_M, Contact, way_by

_Columns = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


@inlined
def place(columns: _Columns, k: int, shape: FloatArray, bound: FloatArray) -> float:
    """Write the box around one mesh, and the sphere; the mesh's volume in m³."""
    box.place((columns[0], columns[1], columns[2]), k, shape, bound)
    bound[3] = columns[3][k]
    return float(columns[4][k])


@inlined
def contact(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float) -> Contact:
    """Where a sphere enters the box around a mesh, enlarged by the radius: no later than it touches the mesh."""
    enter, leave, grown = 0.0, reach, radius * ENLARGED + TOUCHING_M
    offset = subtract(start, load(shapes, row))
    for k in range(3):
        axis = shapes[row, 3 + k], shapes[row, 6 + k], shapes[row, 9 + k]
        place, by, half = dot(axis, offset), way_by(dot(axis, along)), shapes[row, 12 + k] + grown
        first, last = (-half - place) * by, (half - place) * by
        enter, leave = max(enter, min(first, last)), min(leave, max(first, last))
    return (enter, 0.0) if enter <= leave else NEVER


def _derive(objects: Any) -> tuple[FloatArray, ...]:
    """Middles, rotations, half sizes and radii of what is around meshes, and their volumes."""
    library, index = objects.mesh_library, objects.mesh_index
    if library is None:
        return objects.mesh_positions_m, objects.mesh_rotations, np.empty((0, 3)), np.empty(0), np.empty(0)
    around = library.bounds
    half_sizes_m, radii_m = around.half_sizes_m.take(index, axis=0), around.radii_m.take(index)
    middles_m = library.placed_middles_m(index, objects.mesh_positions_m, objects.mesh_rotations)
    return middles_m, objects.mesh_rotations, half_sizes_m, radii_m, library.tables.volumes.take(index)


KIND: Final = Kind(
    "mesh",
    (
        Array("mesh_index", (), Check.INDEX),
        Array("mesh_positions_m", (3,)),
        Array("mesh_rotations", (3, 3), Check.ORTHONORMAL),
    ),
    placed=lambda positions, rotations, index: (index, positions, rotations),
    place=place,
    nearest=box.nearest,
    contact=contact,
    centers=lambda middles, *_: middles,
    in_box=True,
    rows=((3,), (3, 3), (3,), (), ()),
    derive=_derive,
)
