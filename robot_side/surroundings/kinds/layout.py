"""Layout of tables of primitives: the kinds' numbers, and a row of 15 numbers for the shape of each primitive."""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import BOOL, FLOAT64, INT64, inlined, input_array, output_array, tuple_type
from robot_side.compiled.vectors import Vector, add, dot, scale
from robot_side.overlap.solids.solid import sphere_volume

SPHERE: Final = 0
BOX: Final = 1
TETRAHEDRON: Final = 2
HALF_SPACE: Final = 3
MESH: Final = 4
"""Number of the kind of meshes. A mesh has the layout of the box around it. Kernels of `placed_meshes`, called by their
addresses, compute its contact and overlap."""
SHAPE_NUMBERS: Final = 15
"""How many numbers describe the shape of one primitive (columns of a scene table's row)"""
NUMBERS: Final = 20
"""How many numbers describe one primitive of a frame: the values of its arrays, and for a mesh also its sizes from the
library"""
VELOCITY: Final = 12
"""Index at which the velocity begins among an object's numbers, after position and rotation"""

Nearest = tuple[float, Vector]
"""Signed distance from a point to a surface, positive outside, and the unit vector along which this distance falls
fastest. Outside, the vector points towards the nearest point of the surface, inside away from it. So it is the same on
both sides of a face."""
Contact = tuple[float, float]
"""Distance along û, the direction of motion, at which a sphere first touches a primitive, and û·n, where n is normal to
the contact plane and points into the primitive. (0, 1) if the sphere overlaps already; (inf, 0) without a contact
within the given reach."""
NEVER: Final[Contact] = (math.inf, 0.0)
Chord = tuple[float, float]
"""Distances along a line at which it enters and leaves a convex body; it misses the body unless it enters earlier."""
WHOLE: Final[Chord] = (-math.inf, math.inf)
"""Chord of all space"""
ANY_DIRECTION: Final = (0.0, 0.0, 1.0)
"""Direction for a point that is equally far in all directions"""


def around(centers: FloatArray, radii: FloatArray) -> FloatArray:
    """Return the bounding spheres (k, 4) with these centres (k, 3) and radii (k,)."""
    return np.concatenate([centers, radii[:, None]], axis=1)


def lengths(vectors: FloatArray) -> FloatArray:
    """Return the lengths (k, ...) of vectors (k, ..., 3), to the bit the same for one vector as for many."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    found: FloatArray = np.sqrt(x * x + y * y + z * z)
    return found


def rows(*columns: FloatArray, width: int = SHAPE_NUMBERS) -> FloatArray:
    """Return a table (k, width) with these columns (k, ...) side by side; the rest is 0."""
    count, end = len(columns[0]), 0
    table: FloatArray = np.zeros((count, width))
    for column in columns:
        flat = column.reshape(count, math.prod(column.shape[1:]))
        table[:, end : end + flat.shape[1]] = flat
        end += flat.shape[1]
    return table


OVERLAP: Final[tuple[Any, ...]] = (
    *(input_array(2), INT64, FLOAT64, FLOAT64, FLOAT64, FLOAT64, BUNDLE, output_array(1)),
)
"""Argument types of an overlap kernel: shapes (n, 15), the row, the sphere's centre and radius, the scene's meshes, and
an output (3,) for dV/dcentre. The kernel returns the overlap V."""
CONTACT: Final[tuple[Any, ...]] = (BUNDLE, INT64, *(FLOAT64,) * 8, BOOL)
"""Argument types of the contact kernel of meshes (see `placed_meshes`)"""
MESH_CONTACT: Final[Any] = tuple_type(FLOAT64, FLOAT64)
"""Return type of the contact kernel of meshes: a `Contact`"""
CROSSINGS: Final[tuple[Any, ...]] = (BUNDLE, INT64, *(FLOAT64,) * 6, output_array(2), INT64)
"""Argument types of the kernel for a line's crossings of a mesh (see `placed_meshes`)"""
TOUCHING_M: Final = 1e-7
"""Largest gap, and largest depth, in m, at which bodies touch but do not count as overlapping"""
LEAST_CONTACT_M: Final = 1e-12
"""Contact distance, in m, of bodies that touch already; bodies that overlap have 0."""
CLOSING: Final = 1e-9
"""Least û·n at which a surface with the normal n is approached along û; with less, the surface is beside the path."""
MOST_STEPS: Final = 60
ENLARGED: Final = 1.0 + 1e-9
"""Factor on bounds around meshes, so that rounding never misses a contact"""


@inlined
def chord_of_ball(start: Vector, along: Vector, squared_radius: float) -> Chord:
    """Return the chord of a ball around the origin; `along` need not be a unit vector."""
    by = 1.0 / dot(along, along)
    middle = -dot(start, along) * by
    foot = add(start, scale(middle, along))
    half = math.sqrt(max((squared_radius - dot(foot, foot)) * by, 0.0))
    return middle - half, middle + half


@inlined
def cut_chord(chord: Chord, height: float, rise: float) -> Chord:
    """Return the part of a chord below a plane, over which a line is by height + rise · t."""
    enter, leave = chord
    if rise == 0.0:
        return (enter, leave) if height <= 0.0 else (0.0, 0.0)
    at = -height / rise
    return (enter, min(leave, at)) if rise > 0.0 else (max(enter, at), leave)


@inlined
def way_by(part: float) -> float:
    """Return 1 / part, at most 1e15: metres along the path for each metre along an axis.

    part: component of the path's unit vector along that axis.
    """
    return 1.0 / part if abs(part) > 1e-15 else 1e15


def posed(positions: FloatArray, rotations: FloatArray, points: FloatArray) -> FloatArray:
    """Return in the world the points (k, ..., 3) of frames at the poses `positions` (k, 3), `rotations` (k, 3, 3)."""
    between = (1,) * (points.ndim - 2)
    turned = (rotations.reshape(-1, *between, 3, 3) * points[..., None, :]).sum(axis=-1)
    world: FloatArray = positions.reshape(-1, *between, 3) + turned
    return world


@inlined
def to_metres(volume: float, gradient: Vector, size: float, radius: float, overlap_gradient: FloatArray) -> float:
    """Return an overlap's volume in m³, and write its gradient in m²; both are given in units of the length `size`.

    After an overflow the volume is the whole sphere's, so that the operator is warned too early rather than not at all.
    """
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
