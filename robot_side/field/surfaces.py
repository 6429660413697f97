"""Objects within the reach of a look, nearest first: obstacles of one surface together, all others alone.

Pieces of one surface share their reference, as a primitive's pieces do: an edge between two pieces is none in reality.
So each surface is one object of the law, of all its pieces' primitives (docs/feel.md).
"""

import math

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector
from robot_side.field.inflation import DirectionalErrors, own_errors
from robot_side.field.near_rows import bound_rows, first_contact
from robot_side.field.nearest_first import push
from robot_side.field.object_class import OBSTACLE, SKIPPED
from robot_side.field.scratch import SCRATCH, Bundles, ScratchColumns
from robot_side.surroundings.bounds import passes
from robot_side.surroundings.kinds.layout import HALF_SPACE
from robot_side.surroundings.scene_columns import SCENE, SceneColumns, next_object

scene_at, scratch_at = SCENE.at, SCRATCH.at


@inlined
def _surface_of(scene: SceneColumns, thing: int, classes: IntArray) -> int:
    """Return the number of the surface that an object is a piece of; -1 for an object that stands alone."""
    number: int = scene.surfaces[thing] if scene.surfaces.size > 0 and classes[thing] == OBSTACLE else -1
    return number


@inlined
def _begin_surfaces(scene: SceneColumns, scratch: ScratchColumns, classes: IntArray) -> None:
    """Forget the surfaces of the last look, and add up the volumes of this one's."""
    for number in range(scene.surfaces.size):
        scratch.first_pieces[number], scratch.surface_bounds_m[number] = -1, math.inf
        scratch.surface_volumes_m3[number] = 0.0
    for thing in range(scene.surfaces.size):
        number = _surface_of(scene, thing, classes)
        if number >= 0:
            scratch.surface_volumes_m3[number] += scene.object_volumes[thing]


@building_block
def queue_objects(
    bundles: Bundles,
    classes: IntArray,
    approach: FloatArray,
    along: Vector,
    middle: Vector,
    size: float,
    spheres: int,
    shorter: float,
    reach: float,
) -> int:
    """Queue objects and surfaces within reach, with lower bounds of their contact distances; return their number.

    middle, size: sphere around the inflated gripper. shorter: upper bound of what shortens all contact distances.
    reach: the examined distance and the margin. A surface is queued as its first piece.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    count, place, farthest, moves = 0, -1, reach + shorter, approach.size > 0
    for thing in range(approach.size):
        farthest = max(farthest, reach + shorter + approach[thing])
    _begin_surfaces(scene, scratch, classes)
    while True:
        place = next_object(scene, place + 1, middle, along, farthest, size)
        if place >= scene.object_order.size:
            break
        thing = scene.object_order[place]
        if classes[thing] == SKIPPED:
            continue
        lead = shorter + (approach[thing] if moves else 0.0)
        nearest = first_contact(bundles, thing, spheres, along, reach + lead)
        if nearest == math.inf:
            continue
        key, number = nearest - lead if nearest > 0.0 else -math.inf, _surface_of(scene, thing, classes)
        if number >= 0:
            scratch.next_pieces[thing], scratch.first_pieces[number] = scratch.first_pieces[number], thing
            scratch.surface_bounds_m[number] = min(scratch.surface_bounds_m[number], key)
        else:
            count = push(scratch.bounds_m, scratch.objects, count, key, thing)
    for number in range(scene.surfaces.size):
        if scratch.first_pieces[number] >= 0:
            key = scratch.surface_bounds_m[number]
            count = push(scratch.bounds_m, scratch.objects, count, key, scratch.first_pieces[number])
    return count


@building_block
def errors_of(
    bundles: Bundles, thing: int, classes: IntArray, errors: DirectionalErrors, of_objects: FloatArray
) -> DirectionalErrors:
    """Return the errors of a queued object; of a surface, the largest of its pieces."""
    scene = scene_at(bundles.scene)
    unseen, variance, number = of_objects[thing, 0], of_objects[thing, 1], _surface_of(scene, thing, classes)
    for piece in range(scene.surfaces.size if number >= 0 else 0):
        if _surface_of(scene, piece, classes) == number:
            unseen = max(unseen, of_objects[piece, 0])
            # Below P = 0.5 a spread makes the enlargement smaller.
            more = (of_objects[piece, 1] > variance) == (errors.quantile >= 0.0)
            variance = of_objects[piece, 1] if more else variance
    return own_errors(errors, unseen, variance)


@building_block
def approach_of(bundles: Bundles, thing: int, classes: IntArray, approach: FloatArray) -> float:
    """Return the distance by which a queued object approaches; of a surface, the largest of its pieces."""
    if approach.size == 0:
        return 0.0
    scene, most = scene_at(bundles.scene), approach[thing]
    number = _surface_of(scene, thing, classes)
    for piece in range(scene.surfaces.size if number >= 0 else 0):
        if _surface_of(scene, piece, classes) == number:
            most = max(most, approach[piece])
    return float(most)


@building_block
def keep_pieces(
    bundles: Bundles, thing: int, classes: IntArray, middle: Vector, size: float, along: Vector, reach: float
) -> tuple[int, float]:
    """Keep the rows that may be within reach of a queued object, or of all pieces of a surface.

    Return their number, and the volume V_J of the whole object or surface. middle, size: sphere around the gripper.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    number, rows, piece = _surface_of(scene, thing, classes), 0, thing
    while piece >= 0:
        first, end = scene.first_rows[piece], scene.first_rows[piece + 1]
        for row in range(first, end):
            # The queue knows already that an object of one primitive is near.
            if (
                end - first == 1
                or scene.kinds[row] == HALF_SPACE
                or passes(middle, along, reach, scene.bounds, row, size)
            ):
                scratch.rows[rows] = row
                rows += 1
        piece = scratch.next_pieces[piece] if number >= 0 else -1
    bound_rows(bundles, rows)
    return rows, scratch.surface_volumes_m3[number] if number >= 0 else scene.object_volumes[thing]
