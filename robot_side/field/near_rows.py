"""Rows of the present object's primitives within the reach, in blocks; and the contacts of clusters with them."""

import math
from typing import Final

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, dot, load, subtract
from robot_side.field.inflation import around_spheres
from robot_side.field.scratch import PART, ROWS_TOGETHER, SCRATCH, Bundles, ScratchColumns
from robot_side.surroundings.any_kind import contact
from robot_side.surroundings.bounds import passes
from robot_side.surroundings.kinds.layout import HALF_SPACE, MESH
from robot_side.surroundings.scene_columns import SCENE, SceneColumns, contact_with

scene_at, scratch_at = SCENE.at, SCRATCH.at
FEW: Final = ROWS_TOGETHER
"""Number of rows up to which blocks would cost more than they save"""


@inlined
def _ahead(bounds: FloatArray, row: int, center: Vector, along: Vector, radius: float) -> float:
    """Return the distance at which a sphere that moves along `along` touches the bounding sphere in `row`.

    The two are known to touch somewhere along the way.
    """
    offset, together = subtract(load(bounds, row), center), bounds[row, 3] + radius
    before = dot(offset, along)
    return max(before - math.sqrt(max(before * before - dot(offset, offset) + together * together, 0.0)), 0.0)


@building_block
def first_contact(bundles: Bundles, thing: int, spheres: int, along: Vector, reach: float) -> float:
    """Return a lower bound of the distance at which any part of the gripper touches an object; ∞ beyond `reach`.

    Meshes count as their bounding boxes, small primitives as their bounding spheres.
    """
    scene, scratch, least = scene_at(bundles.scene), scratch_at(bundles.scratch), math.inf
    for row in range(scene.first_rows[thing], scene.first_rows[thing + 1]):
        kind = scene.kinds[row]
        for part in range((spheres + PART - 1) // PART):
            center, size, near = load(scratch.parts, part), scratch.parts[part, 3], min(reach, least)
            if kind != HALF_SPACE and not passes(center, along, near, scene.bounds, row, size):
                continue
            if kind != HALF_SPACE and scene.bounds[row, 3] < size:
                # For what is small beside the gripper, the sphere around it is near enough, and costs a tenth.
                distance = _ahead(scene.bounds, row, center, along, size)
            else:
                distance, _ = contact(kind, scene.shapes, row, center, size, along, near)
            least = min(least, distance)
    return least if least <= reach else math.inf


@building_block
def bound_rows(bundles: Bundles, rows: int) -> None:
    """Bound each block of the kept rows by a sphere, for `next_row`."""
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    if rows <= FEW:
        return
    for k in range(rows):
        for axis in range(4):
            scratch.row_bounds[k, axis] = scene.bounds[scratch.rows[k], axis]
    for first in range(0, rows, ROWS_TOGETHER):
        middle, radius = around_spheres(scratch.row_bounds, first, min(first + ROWS_TOGETHER, rows))
        block = scratch.row_blocks[first // ROWS_TOGETHER]
        block[0], block[1], block[2], block[3] = *middle, radius


@inlined
def next_row(
    scene: SceneColumns,
    scratch: ScratchColumns,
    place: int,
    rows: int,
    center: Vector,
    along: Vector,
    reach: float,
    radius: float,
) -> int:
    """Return the first place among the kept rows, from `place` on, of a primitive that a swept sphere may touch.

    Return `rows` if there is none.
    """
    while place < rows:
        if (
            rows > FEW
            and place % ROWS_TOGETHER == 0
            and not passes(center, along, reach, scratch.row_blocks, place // ROWS_TOGETHER, radius)
        ):
            place += ROWS_TOGETHER
            continue
        row = scratch.rows[place]
        if scene.kinds[row] == HALF_SPACE or passes(center, along, reach, scene.bounds, row, radius):
            return place
        place += 1
    return rows


@building_block
def bound_of(
    bundles: Bundles, rows: int, spheres: FloatArray, which: int, along: Vector, reach: float, quick: bool
) -> tuple[float, bool]:
    """Return a lower bound of the distance at which a cluster or part, a row of `spheres`, touches a kept primitive.

    Return also whether the distance itself may be greater. The bound is infinite beyond `reach`. quick: whether small
    primitives count as their bounding spheres.

    Meshes count as their bounding boxes.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    center, radius, least, rough = load(spheres, which), spheres[which, 3], math.inf, False
    place = next_row(scene, scratch, 0, rows, center, along, reach, radius)
    while place < rows:
        row, near = scratch.rows[place], min(reach, least)
        if quick and scene.kinds[row] != HALF_SPACE and scene.bounds[row, 3] < radius:
            found, rough = _ahead(scene.bounds, row, center, along, radius), True
        else:
            found, _ = contact(scene.kinds[row], scene.shapes, row, center, radius, along, near)
            rough = rough or scene.kinds[row] == MESH
        least = min(least, found)
        place = next_row(scene, scratch, place + 1, rows, center, along, min(reach, least), radius)
    return least, rough


@building_block
def cluster_contact(bundles: Bundles, rows: int, cluster: int, along: Vector, reach: float, clear: bool) -> float:
    """Return the least distance at which a cluster's bounding sphere touches a primitive of the kept rows."""
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    center, radius, least = load(scratch.clusters, cluster), scratch.clusters[cluster, 3], math.inf
    place = next_row(scene, scratch, 0, rows, center, along, reach, radius)
    while place < rows:
        near = min(reach, least)
        least = min(least, contact_with(scene, scratch.rows[place], center, along, radius, near, clear)[0])
        place = next_row(scene, scratch, place + 1, rows, center, along, min(reach, least), radius)
    return least
