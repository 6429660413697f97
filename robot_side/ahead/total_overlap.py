"""How much of some spheres lies in the objects now, in all: Σ V_ij (eq. 11-12)."""

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.ahead.ask import write_job
from robot_side.ahead.find import PASSED_OVER
from robot_side.ahead.kinds import half_space, sphere
from robot_side.ahead.kinds.layout import HALF_SPACE, SPHERE
from robot_side.ahead.overlaps import work_out
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import JOB, Tables
from robot_side.ahead.way import passes
from robot_side.compiled.kernel import (
    COUNT,
    NUMBER,
    compiled,
    input_array,
    input_indices,
    output_array,
    output_indices,
    record_array,
)
from robot_side.compiled.vectors import load


def total_overlap_m3(spheres: FloatArray, scene: SceneTable, standing: IntArray, tables: Tables) -> float:
    """Σ V_ij in m³ of spheres (m, 4), centres and radii, with all objects but those passed over; standing (k,).

    ValueError for a sphere that is not finite, which would compare as far away from everything.
    """
    require_finite("spheres", spheres)
    total = 0.0
    for first in range(0, len(spheres), _AT_A_TIME):
        part = np.ascontiguousarray(spheres[first : first + _AT_A_TIME])
        while True:
            jobs = tables.jobs
            at_once = _gather(
                part,
                scene.bounds,
                scene.shapes,
                scene.kinds,
                scene.first_rows,
                scene.object_bounds,
                standing,
                jobs.counts,
                jobs.room,
                jobs.owners,
                jobs.centers,
                jobs.radii,
                jobs.volumes,
                jobs.gradients,
                jobs.box_centers,
                jobs.box_rotations,
                jobs.box_half_sizes,
                jobs.vertices,
            )
            if at_once >= 0.0:
                break
            tables.jobs = type(jobs)(2 * jobs.room)
        total += at_once
        if work_out(jobs, scene):
            ends = jobs.room * np.arange(len(jobs.counts)) + jobs.counts
            total += sum(jobs.volumes[end - count : end].sum() for end, count in zip(ends, jobs.counts, strict=True))
    return float(total)


_AT_A_TIME = 256


@compiled(
    *(input_array(2), input_array(2), input_array(2), input_indices(), input_indices(), input_array(2)),
    *(input_indices(), output_indices(), COUNT, record_array(JOB)),
    *(output_array(2), output_array(1), output_array(1), output_array(2)),
    *(output_array(2), output_array(3), output_array(2), output_array(3)),
    returns=NUMBER,
)
def _gather(
    spheres: FloatArray,
    bounds: FloatArray,
    shapes: FloatArray,
    kinds: IntArray,
    first_rows: IntArray,
    object_bounds: FloatArray,
    standing: IntArray,
    job_counts: IntArray,
    room: int,
    jobs: np.ndarray,
    centers: FloatArray,
    radii: FloatArray,
    volumes: FloatArray,
    gradients: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    vertices: FloatArray,
) -> float:
    """Write a job for each pair that bounds do not settle; the sum of the closed forms, -1 where there is no room."""
    job_counts[:] = 0
    total, nowhere = 0.0, (0.0, 0.0, 0.0)
    for thing in range(standing.size):
        if standing[thing] == PASSED_OVER:
            continue
        for i in range(spheres.shape[0]):
            center, radius = load(spheres, i), spheres[i, 3]
            if not passes(center, nowhere, 0.0, object_bounds, thing, radius):
                continue
            for row in range(first_rows[thing], first_rows[thing + 1]):
                kind = kinds[row]
                if kind == HALF_SPACE:
                    total += half_space.overlap(shapes, row, center, radius)[0]
                elif passes(center, nowhere, 0.0, bounds, row, radius):
                    if kind == SPHERE:
                        total += sphere.overlap(shapes, row, center, radius)[0]
                        continue
                    if job_counts.max() == room:
                        return -1.0
                    write_job(
                        kind,
                        row,
                        i,
                        0,
                        center,
                        radius,
                        shapes,
                        job_counts,
                        room,
                        jobs,
                        centers,
                        radii,
                        volumes,
                        gradients,
                        box_centers,
                        box_rotations,
                        box_half_sizes,
                        vertices,
                    )
    return total
