"""How much of some spheres lies in the objects now, in all: Σ V_ij (eq. 11-12)."""

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.ahead.ask import room_of, write_job
from robot_side.ahead.find import PASSED_OVER
from robot_side.ahead.kinds import half_space, sphere
from robot_side.ahead.kinds.layout import HALF_SPACE, SPHERE
from robot_side.ahead.overlaps import work_out
from robot_side.ahead.scene_table import SceneTable, scene_at
from robot_side.ahead.tables import Tables, tables_at
from robot_side.ahead.way import passes
from robot_side.compiled.bundle import BUNDLE
from robot_side.compiled.kernel import NUMBER, compiled, input_array, input_indices
from robot_side.compiled.vectors import load


def total_overlap_m3(spheres: FloatArray, scene: SceneTable, standing: IntArray, tables: Tables) -> float:
    """Σ V_ij in m³ of spheres (m, 4), centres and radii, with all objects but those passed over; standing (k,).

    ValueError for a sphere that is not finite, which would compare as far away from everything.
    """
    require_finite("spheres", spheres)
    total = 0.0
    for first in range(0, len(spheres), _AT_A_TIME):
        part = np.ascontiguousarray(spheres[first : first + _AT_A_TIME])
        while (at_once := _gather(part, standing, scene.addresses, tables.addresses)) < 0.0:
            tables.grow_jobs()
        jobs = tables.jobs
        total += at_once
        if work_out(jobs, scene):
            counts, volumes = jobs.columns.counts, jobs.columns.volumes
            total += sum(volumes[kind * jobs.room :][:count].sum() for kind, count in enumerate(counts))
    return float(total)


_AT_A_TIME = 256


@compiled(input_array(2), input_indices(), BUNDLE, BUNDLE, returns=NUMBER)
def _gather(spheres: FloatArray, standing: IntArray, scene_bundle: IntArray, tables_bundle: IntArray) -> float:
    """Write a job for each pair that bounds do not settle; the sum of the closed forms, -1 where there is no room."""
    scene, jobs = scene_at(scene_bundle), tables_at(tables_bundle).jobs
    jobs.counts[:] = 0
    total, nowhere = 0.0, (0.0, 0.0, 0.0)
    for thing in range(standing.size):
        if standing[thing] == PASSED_OVER:
            continue
        for i in range(spheres.shape[0]):
            center, radius = load(spheres, i), spheres[i, 3]
            if not passes(center, nowhere, 0.0, scene.object_bounds, thing, radius):
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
    return total
