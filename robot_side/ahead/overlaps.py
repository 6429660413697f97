"""The overlaps that a round asks for, by the kernels of each kind (eq. 11-12)."""

from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import MESH_JOBS, TETRAHEDRON_JOBS, Jobs
from robot_side.compiled.kernel import Compiled
from robot_side.overlap.lanes.box_batch import overlap_boxes
from robot_side.overlap.lanes.tetrahedron_batch import overlap_tetrahedra
from robot_side.overlap.precise.kernels import precise_boxes, precise_tetrahedra


def work_out(jobs: Jobs, scene: SceneTable) -> int:
    """Fill in volumes and gradients of all jobs; how many there were."""
    columns = jobs.columns
    boxes, tetrahedra, meshes = (int(count) for count in columns.counts)
    if boxes:
        shapes = columns.box_centers[:boxes], columns.box_rotations[:boxes], columns.box_half_sizes[:boxes]
        _exactly(overlap_boxes, precise_boxes, jobs, slice(0, boxes), shapes)
    if tetrahedra:
        part = slice(TETRAHEDRON_JOBS * jobs.room, TETRAHEDRON_JOBS * jobs.room + tetrahedra)
        _exactly(overlap_tetrahedra, precise_tetrahedra, jobs, part, (columns.vertices[:tetrahedra],))
    if meshes:
        _meshes(jobs, scene, meshes)
    return boxes + tetrahedra + meshes


def _exactly(overlap: Compiled, precise: Compiled, jobs: Jobs, part: slice, shapes: tuple[object, ...]) -> None:
    """The lanes, and the precise forms for those for which doubles do not suffice."""
    results = jobs.columns.volumes[part], jobs.columns.gradients[part], jobs.areas[part]
    rows = jobs.unsettled[: part.stop - part.start + 1]
    spheres = jobs.columns.centers[part], jobs.columns.radii[part]
    unsettled = overlap(*spheres, *shapes, *results, rows)
    if unsettled:
        precise(*spheres, *shapes, rows[:unsettled], *results)


def _meshes(jobs: Jobs, scene: SceneTable, count: int) -> None:
    # A scene without meshes does not load the kernels for them.
    from robot_side.overlap.meshes.mesh_kernels import overlap_loop  # noqa: PLC0415

    columns, part = jobs.columns, slice(MESH_JOBS * jobs.room, MESH_JOBS * jobs.room + count)
    placed = scene.rows_of_kind.take(columns.owners["row"][part])
    results = columns.volumes[part], columns.gradients[part], jobs.areas[part], jobs.unsettled[:count]
    overlap_loop(columns.centers[part], columns.radii[part], placed, *scene.placed_meshes, *results)
