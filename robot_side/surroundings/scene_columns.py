"""Columns of a scene for kernels: primitives, objects and blocks of objects; and contact with any primitive."""

from typing import Final, NamedTuple

from common.arrays import FloatArray, IntArray
from robot_side.compiled.calls import call_at_address
from robot_side.compiled.columns import BUNDLED, INDICES, NUMBERS, Declared, rows
from robot_side.compiled.kernel import INT64, inlined
from robot_side.compiled.vectors import Vector
from robot_side.surroundings.any_kind import chord, contact
from robot_side.surroundings.blocks import TOGETHER
from robot_side.surroundings.bounds import passes
from robot_side.surroundings.kinds.layout import CONTACT, CROSSINGS, MESH, MESH_CONTACT, SHAPE_NUMBERS, Contact


class SceneColumns(NamedTuple):
    """Columns of a scene, passed to kernels as one bundle; the fields are those of SceneTable."""

    bounds: FloatArray
    shapes: FloatArray
    kinds: IntArray
    first_rows: IntArray
    object_bounds: FloatArray
    object_volumes: FloatArray
    surfaces: IntArray
    pieces: IntArray
    object_order: IntArray
    ordered_bounds: FloatArray
    block_bounds: FloatArray
    group_bounds: FloatArray
    kernels: IntArray
    meshes: IntArray


SCENE: Final = Declared(
    SceneColumns,
    *(rows(4), rows(SHAPE_NUMBERS), INDICES, INDICES, rows(4), NUMBERS, INDICES, INDICES),
    *(INDICES, rows(4), rows(4), rows(4), INDICES, BUNDLED),
)
_mesh_contact, _mesh_crossings = call_at_address(MESH_CONTACT, CONTACT), call_at_address(INT64, CROSSINGS)


@inlined
def contact_in_front(scene: SceneColumns, row: int, start: Vector, along: Vector, radius: float, reach: float) -> float:
    """Return the distance at which a sphere next touches a front triangle (n·û < 0) of a mesh, or infinity."""
    found, _ = _mesh_contact(scene.kernels[-1], (scene.meshes, row, *start, *along, radius, reach, True))
    return float(found)


@inlined
def contact_with(
    scene: SceneColumns, row: int, start: Vector, along: Vector, radius: float, reach: float, clear: bool
) -> Contact:
    """Return the first contact of a sphere with the primitive in `row`.

    For a mesh that is not convex û·n is 0: no bound. clear: the sphere is known not to overlap, so a mesh is not tested
    for an overlap.
    """
    kind = scene.kinds[row]
    found, closing = contact(kind, scene.shapes, row, start, radius, along, reach)
    if kind == MESH and found <= reach:
        # So far the contact is the one with the box around the mesh.
        found, closing = _mesh_contact(scene.kernels[-1], (scene.meshes, row, *start, *along, radius, reach, clear))
    return found, closing


@inlined
def add_crossings(
    scene: SceneColumns, row: int, start: Vector, along: Vector, crossings: FloatArray, count: int
) -> int:
    """Append where a line enters and leaves the primitive in `row`, as `crossings_of_mesh` does; return the count."""
    enter, leave = chord(scene.kinds[row], scene.shapes, row, start, along)
    if not enter < leave or count + 2 > crossings.shape[0]:
        return count
    if scene.kinds[row] == MESH:
        return int(_mesh_crossings(scene.kernels[-2], (scene.meshes, row, *start, *along, crossings, count)))
    crossings[count, 0], crossings[count, 1] = enter, 1.0
    crossings[count + 1, 0], crossings[count + 1, 1] = leave, -1.0
    return count + 2


@inlined
def next_object(scene: SceneColumns, place: int, center: Vector, along: Vector, reach: float, radius: float) -> int:
    """Return the first index in `object_order`, from `place` on, of an object that a swept sphere may touch.

    Return the number of objects in the order if there is none.
    """
    size = scene.object_order.size
    while place < size:
        block = place // TOGETHER
        if place % (TOGETHER * TOGETHER) == 0 and not passes(
            center, along, reach, scene.group_bounds, block // TOGETHER, radius
        ):
            place += TOGETHER * TOGETHER
        elif place % TOGETHER == 0 and not passes(center, along, reach, scene.block_bounds, block, radius):
            place += TOGETHER
        elif passes(center, along, reach, scene.ordered_bounds, place, radius):
            break
        else:
            place += 1
    return place
