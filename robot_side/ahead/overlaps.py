"""The overlaps that a round asks for, by the kernels of each kind (eq. 11-12)."""

from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import BOX_JOBS, MESH_JOBS, TETRAHEDRON_JOBS, JobParts, Jobs
from robot_side.compiled.kernel import Compiled
from robot_side.overlap.lanes.box_batch import overlap_boxes
from robot_side.overlap.lanes.tetrahedron_batch import overlap_tetrahedra
from robot_side.overlap.precise.kernels import precise_boxes, precise_tetrahedra


def work_out(jobs: Jobs, scene: SceneTable) -> int:
    """Fill in volumes and gradients of all jobs; how many there were."""
    columns = jobs.columns
    boxes, tetrahedra, meshes = columns.counts.tolist()
    if boxes:
        shapes = columns.box_centers, columns.box_rotations, columns.box_half_sizes
        _exactly(overlap_boxes, precise_boxes, jobs.parts(BOX_JOBS, boxes, shapes))
    if tetrahedra:
        _exactly(overlap_tetrahedra, precise_tetrahedra, jobs.parts(TETRAHEDRON_JOBS, tetrahedra, (columns.vertices,)))
    if meshes:
        _meshes(jobs, scene, meshes)
    return int(boxes + tetrahedra + meshes)


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
    results = columns.volumes[part], columns.gradients[part], jobs.areas[part], jobs.unsettled[:count]
    overlap_loop(columns.centers[part], columns.radii[part], placed, *scene.placed_meshes, *results)
