"""Overlaps by the kernels of each kind (eq. 11-12): those that a round asks for, and how much there is in all."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.ahead.ask import room_of, write_job
from robot_side.ahead.find import PASSED_OVER, around_spheres
from robot_side.ahead.kinds import half_space, sphere
from robot_side.ahead.kinds.layout import HALF_SPACE, SPHERE
from robot_side.ahead.scene_table import SceneTable, next_place, scene_at
from robot_side.ahead.tables import (
    BOX_JOBS,
    JOB_KINDS,
    MESH_JOBS,
    TETRAHEDRON_JOBS,
    JobColumns,
    JobParts,
    Jobs,
    Tables,
    tables_at,
)
from robot_side.ahead.way import passes
from robot_side.compiled.bundle import BUNDLE
from robot_side.compiled.calls import call_of
from robot_side.compiled.kernel import COUNT, NUMBER, Compiled, compiled, inlined, input_array, input_indices
from robot_side.compiled.vectors import add, load
from robot_side.overlap.lanes.box_batch import overlap_boxes
from robot_side.overlap.lanes.tetrahedron_batch import overlap_tetrahedra
from robot_side.overlap.precise.kernels import precise_boxes, precise_tetrahedra

_overlap_boxes, _overlap_tetrahedra = call_of(overlap_boxes), call_of(overlap_tetrahedra)
_precise_boxes, _precise_tetrahedra = call_of(precise_boxes), call_of(precise_tetrahedra)


@inlined
def worked_out(jobs: JobColumns) -> bool:
    """Fill in volumes and gradients of all jobs; False where `work_out` has to: for meshes, and the first of a kind."""
    boxes, tetrahedra, kernels = jobs.counts[BOX_JOBS], jobs.counts[TETRAHEDRON_JOBS], jobs.kernels
    if jobs.counts[MESH_JOBS] > 0 or (boxes > 0 and kernels[0] == 0) or (tetrahedra > 0 and kernels[2] == 0):
        return False
    if boxes > 0:
        part = slice(BOX_JOBS * room_of(jobs), BOX_JOBS * room_of(jobs) + boxes)
        spheres = jobs.centers[part], jobs.radii[part]
        shapes = jobs.box_centers[:boxes], jobs.box_rotations[:boxes], jobs.box_half_sizes[:boxes]
        results = jobs.volumes[part], jobs.gradients[part], jobs.areas[part]
        unsettled = _overlap_boxes(kernels[0], (*spheres, *shapes, *results, jobs.unsettled[: boxes + 1]))
        if unsettled > 0:
            _precise_boxes(kernels[1], (*spheres, *shapes, jobs.unsettled[:unsettled], *results))
    if tetrahedra > 0:
        part = slice(TETRAHEDRON_JOBS * room_of(jobs), TETRAHEDRON_JOBS * room_of(jobs) + tetrahedra)
        spheres, corners = (jobs.centers[part], jobs.radii[part]), jobs.vertices[:tetrahedra]
        results = jobs.volumes[part], jobs.gradients[part], jobs.areas[part]
        unsettled = _overlap_tetrahedra(kernels[2], (*spheres, corners, *results, jobs.unsettled[: tetrahedra + 1]))
        if unsettled > 0:
            _precise_tetrahedra(kernels[3], (*spheres, corners, jobs.unsettled[:unsettled], *results))
    return True


@inlined
def summed(jobs: JobColumns) -> float:
    """The volume in all."""
    total = 0.0
    for kind in range(JOB_KINDS):
        first = kind * room_of(jobs)
        for job in range(first, first + jobs.counts[kind]):
            total += jobs.volumes[job]
    return total


def work_out(jobs: Jobs, scene: SceneTable) -> None:
    """The same from Python, which notes where the kernels are."""
    columns = jobs.columns
    boxes, tetrahedra, meshes = columns.counts.tolist()
    if boxes:
        shapes = columns.box_centers, columns.box_rotations, columns.box_half_sizes
        _exactly(overlap_boxes, precise_boxes, jobs.parts(BOX_JOBS, boxes, shapes))
        columns.kernels[:2] = overlap_boxes.address, precise_boxes.address
    if tetrahedra:
        _exactly(overlap_tetrahedra, precise_tetrahedra, jobs.parts(TETRAHEDRON_JOBS, tetrahedra, (columns.vertices,)))
        columns.kernels[2:] = overlap_tetrahedra.address, precise_tetrahedra.address
    if meshes:
        _meshes(jobs, scene, meshes)


def _exactly(overlap: Compiled, precise: Compiled, parts: JobParts) -> None:
    """The lanes, and the precise forms for those for which doubles do not suffice."""
    unsettled = overlap(*parts.given, *parts.results, parts.unsettled)
    if unsettled:
        precise(*parts.given, parts.unsettled[:unsettled], *parts.results)


def _meshes(jobs: Jobs, scene: SceneTable, count: int) -> None:
    # A scene without meshes does not load the kernels for them.
    from robot_side.overlap.meshes.mesh_kernels import overlap_loop  # noqa: PLC0415

    columns, part = jobs.columns, slice(MESH_JOBS * jobs.room, MESH_JOBS * jobs.room + count)
    placed = scene.rows_of_kind.take(columns.owners["row"][part])
    results = columns.volumes[part], columns.gradients[part], columns.areas[part], columns.unsettled[:count]
    overlap_loop(columns.centers[part], columns.radii[part], placed, *scene.placed_meshes, *results)


def total_overlap_m3(spheres: FloatArray, scene: SceneTable, standing: IntArray, tables: Tables) -> float:
    """Σ V_ij in m³ of spheres (m, 4), centres and radii, with all objects but those passed over; standing (k,).

    ValueError for a sphere that is not finite, which would compare as far away from everything.
    """
    return _total_m3(spheres, len(spheres), np.zeros_like(spheres), np.zeros(3), scene, standing, tables)


def looked_overlap_m3(moved_m: FloatArray, count: int, scene: SceneTable, standing: IntArray, tables: Tables) -> float:
    """The same for the `count` spheres of the last look, inflated by D_σ as it was found there, moved by (3,)."""
    return _total_m3(tables.spheres, count, tables.sigma_m, moved_m, scene, standing, tables)


def _total_m3(
    spheres: FloatArray,
    count: int,
    inflated_m: FloatArray,
    moved_m: FloatArray,
    scene: SceneTable,
    standing: IntArray,
    tables: Tables,
) -> float:
    total = 0.0
    for first in range(0, count, _AT_A_TIME):
        part = spheres, inflated_m, moved_m, first, min(first + _AT_A_TIME, count), standing
        while (at_once := _gather(*part, scene.addresses, tables.addresses)) < 0.0:
            tables.grow_jobs()
        if math.isnan(at_once):
            raise ValueError("spheres holds NaN or infinity; valid: finite numbers")
        total += at_once
        jobs = tables.jobs
        if jobs.columns.counts.any():
            work_out(jobs, scene)
            for kind, done in enumerate(jobs.columns.counts):
                total += jobs.columns.volumes[kind * jobs.room :][:done].sum()
    return float(total)


_AT_A_TIME = 256


@compiled(
    *(input_array(2), input_array(2), input_array(1), COUNT, COUNT, input_indices(), BUNDLE, BUNDLE),
    returns=NUMBER,
)
def _gather(
    spheres: FloatArray,
    inflated: FloatArray,
    moved: FloatArray,
    begin: int,
    end: int,
    standing: IntArray,
    scene_bundle: IntArray,
    tables_bundle: IntArray,
) -> float:
    """The sum of the overlaps, but of those for which it leaves jobs.

    spheres (m, 4), of which those from `begin` to `end` count; inflated (m, 1 or more): by its first column. -1 where
    there is no room, NaN for what is not finite.
    """
    scene, jobs = scene_at(scene_bundle), tables_at(tables_bundle).jobs
    shift = load(moved.reshape(1, 3), 0)
    check = 0.0
    for i in range(begin, end):
        check += spheres[i, 0] + spheres[i, 1] + spheres[i, 2] + spheres[i, 3] + inflated[i, 0]
    if not math.isfinite(check + shift[0] + shift[1] + shift[2]):
        return math.nan
    jobs.counts[:] = 0
    total, nowhere = 0.0, (0.0, 0.0, 0.0)
    middle, around = around_spheres(spheres, inflated, begin, end)
    middle = add(middle, shift)
    place = -1
    while True:
        place = next_place(scene.there, place + 1, middle, nowhere, 0.0, around)
        if place >= scene.there.order.size:
            break
        thing = scene.there.order[place]
        for i in range(begin, end):
            center, radius = add(load(spheres, i), shift), spheres[i, 3] + inflated[i, 0]
            passed_over = standing[thing] == PASSED_OVER
            if passed_over or not passes(center, nowhere, 0.0, scene.object_bounds, thing, radius):
                continue
            for row in range(scene.first_rows[thing], scene.first_rows[thing + 1]):
                kind = scene.kinds[row]
                if kind == HALF_SPACE:
                    total += half_space.overlap(scene.shapes, row, center, radius)[0]
                elif passes(center, nowhere, 0.0, scene.bounds, row, radius):
                    if kind == SPHERE:
                        total += sphere.overlap(scene.shapes, row, center, radius)[0]
                        continue
                    if jobs.counts.max() == room_of(jobs):
                        return -1.0
                    write_job(kind, row, i, 0, center, radius, scene.shapes, jobs)
    if worked_out(jobs):
        total += summed(jobs)
        jobs.counts[:] = 0
    return total
