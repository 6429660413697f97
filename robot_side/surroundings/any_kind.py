"""For a primitive of any kind: nearest point, contact of a moving sphere with the primitive, and chord of a line."""

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block
from robot_side.compiled.vectors import Vector
from robot_side.surroundings.kinds.kind import by_kind
from robot_side.surroundings.kinds.layout import Chord, Contact, Nearest
from robot_side.surroundings.perceived import KINDS

_nearest, _contact = by_kind([kind.nearest for kind in KINDS]), by_kind([kind.contact for kind in KINDS])
_chord = by_kind([kind.chord for kind in KINDS])


@building_block
def nearest(kind: int, shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """Return signed distance and direction from `point` to the primitive in `row`; for a mesh, to the box around it."""
    found: Nearest = _nearest(kind, shapes, row, point)
    return found


@building_block
def contact(
    kind: int, shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float
) -> Contact:
    """Return the first contact of a sphere moving along the unit vector `along`; for a mesh, with the box around it."""
    found: Contact = _contact(kind, shapes, row, start, radius, along, reach)
    return found


@building_block
def chord(kind: int, shapes: FloatArray, row: int, start: Vector, along: Vector) -> Chord:
    """Return the chord of a line along the unit vector `along`; for a mesh, in the box around it."""
    found: Chord = _chord(kind, shapes, row, start, along)
    return found
