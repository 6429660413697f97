"""Objects within the reach of a look, nearest first: pieces of one surface together, all others alone.

Pieces of one surface share their reference, as a primitive's pieces do: an edge between two pieces is none in reality.
So each surface is one object of the law, of all its pieces' primitives (docs/feel.md). Its pieces are of one class.
"""

import math

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector
from robot_side.field.inflation import DirectionalErrors, own_errors
from robot_side.field.near_rows import bound_rows, first_contact
from robot_side.field.nearest_first import push
from robot_side.field.object_class import SKIPPED
from robot_side.field.scratch import SCRATCH, Bundles, OfSurface
from robot_side.surroundings.bounds import passes
from robot_side.surroundings.kinds.layout import HALF_SPACE
from robot_side.surroundings.scene_columns import SCENE, SceneColumns, next_object

scene_at, scratch_at = SCENE.at, SCRATCH.at


@inlined
def _surface_of(scene: SceneColumns, thing: int, classes: IntArray) -> int:
    """Return the number of the surface that an object is a piece of; -1 for an object that stands alone."""
    number: int = scene.surfaces[thing] if scene.surfaces.size > 0 and classes[thing] != SKIPPED else -1
    return number


@inlined
def _of_same(scene: SceneColumns, place: int, number: int) -> bool:
    """Return whether there is a piece of a surface at a place among the scene's pieces."""
    size = scene.pieces.size
    return place < size and scene.pieces[place] >= 0 and scene.surfaces[scene.pieces[place]] == number


@building_block
def begin_surfaces(
    bundles: Bundles, classes: IntArray, spread_enlarges: bool, approach: FloatArray, of_objects: FloatArray
) -> None:
    """Forget the surfaces of the last look, and fill the numbers of this one's.

    spread_enlarges: below P = 0.5 a spread makes the enlargement smaller. approach, of_objects: as in a look.
    """
    scene, scratch, last = scene_at(bundles.scene), scratch_at(bundles.scratch), -1
    for place in range(scene.pieces.size):
        thing = scene.pieces[place]
        if thing < 0:
            break
        scratch.near[thing] = False
        if classes[thing] == SKIPPED:
            continue
        number = scene.surfaces[thing]
        its = scratch.of_surfaces[number]
        unseen = of_objects[thing, 0] if of_objects.size > 0 else 0.0
        variance = of_objects[thing, 1] if of_objects.size > 0 else 0.0
        comes = approach[thing] if approach.size > 0 else 0.0
        if number != last:
            scratch.first_pieces[number], last = place, number
            its[OfSurface.BOUND], its[OfSurface.VOLUME] = math.inf, 0.0
            its[OfSurface.UNSEEN], its[OfSurface.VARIANCE], its[OfSurface.APPROACH] = unseen, variance, comes
        its[OfSurface.VOLUME] += scene.object_volumes[thing]
        its[OfSurface.UNSEEN] = max(its[OfSurface.UNSEEN], unseen)
        if (variance > its[OfSurface.VARIANCE]) == spread_enlarges:
            its[OfSurface.VARIANCE] = variance
        its[OfSurface.APPROACH] = max(its[OfSurface.APPROACH], comes)


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
    reach: the examined distance and two margins. A surface is queued as its first piece; `begin_surfaces`
    was called before.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    count, place, farthest, moves = 0, -1, reach + shorter, approach.size > 0
    for thing in range(approach.size):
        farthest = max(farthest, reach + shorter + approach[thing])
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
            its = scratch.of_surfaces[number]
            scratch.near[thing], its[OfSurface.BOUND] = True, min(its[OfSurface.BOUND], key)
        else:
            count = push(scratch.bounds_m, scratch.objects, count, key, thing)
    for place in range(scene.pieces.size):
        thing = scene.pieces[place]
        if thing < 0:
            break
        number = _surface_of(scene, thing, classes)
        if number >= 0 and scratch.first_pieces[number] == place:
            key = scratch.of_surfaces[number, OfSurface.BOUND]
            if key < math.inf:
                count = push(scratch.bounds_m, scratch.objects, count, key, thing)
    return count


@building_block
def errors_of(
    bundles: Bundles, thing: int, classes: IntArray, errors: DirectionalErrors, of_objects: FloatArray
) -> DirectionalErrors:
    """Return the errors of a queued object; of a surface, the largest of its pieces."""
    number = _surface_of(scene_at(bundles.scene), thing, classes)
    if number < 0:
        return own_errors(errors, of_objects[thing, 0], of_objects[thing, 1])
    its = scratch_at(bundles.scratch).of_surfaces[number]
    return own_errors(errors, its[OfSurface.UNSEEN], its[OfSurface.VARIANCE])


@building_block
def approach_of(bundles: Bundles, thing: int, classes: IntArray, approach: FloatArray) -> float:
    """Return the distance by which a queued object approaches; of a surface, the largest of its pieces."""
    if approach.size == 0:
        return 0.0
    number = _surface_of(scene_at(bundles.scene), thing, classes)
    found = approach[thing] if number < 0 else scratch_at(bundles.scratch).of_surfaces[number, OfSurface.APPROACH]
    return float(found)


@building_block
def keep_pieces(
    bundles: Bundles, thing: int, classes: IntArray, middle: Vector, size: float, along: Vector, reach: float
) -> tuple[int, float]:
    """Keep the rows that may be within reach of a queued object, or of all pieces of a surface.

    Return their number, and the volume V_J of the whole object or surface. middle, size: sphere around the gripper.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    number, rows, piece, place = _surface_of(scene, thing, classes), 0, thing, 0
    if number >= 0:
        place = scratch.first_pieces[number]
    while piece >= 0:
        first, end = scene.first_rows[piece], scene.first_rows[piece + 1]
        if number >= 0 and not scratch.near[piece]:
            end = first
        for row in range(first, end):
            # The queue knows already that an object of one primitive is near.
            if (
                (end - first == 1 and number < 0)
                or scene.kinds[row] == HALF_SPACE
                or passes(middle, along, reach, scene.bounds, row, size)
            ):
                scratch.rows[rows] = row
                rows += 1
        place += 1
        piece = scene.pieces[place] if number >= 0 and _of_same(scene, place, number) else -1
    bound_rows(bundles, rows)
    return rows, scratch.of_surfaces[number, OfSurface.VOLUME] if number >= 0 else scene.object_volumes[thing]
