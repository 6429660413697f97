"""Distances from points and spheres to the objects of a frame, by the compiled functions for nearest points."""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import FLOAT64, compiled, input_array, input_indices, output_array
from robot_side.compiled.vectors import load, norm, subtract
from robot_side.surroundings.any_kind import nearest
from robot_side.surroundings.bounds import around
from robot_side.surroundings.kinds.layout import MESH
from robot_side.surroundings.scene_table import SceneTable


def nearest_mesh_points(points_m: FloatArray, scene: SceneTable, rows: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return distances (p,) in m and directions (p, 3) from points (p, 3) to the meshes in `rows` (p,), pair by pair.

    Distances are positive outside. A direction is the unit vector along which the distance falls fastest. ValueError
    for a scene without a mesh library.
    """
    # A scene without meshes does not load the kernels for them.
    from robot_side.overlap.meshes.mesh_library import nearest_mesh_pairs  # noqa: PLC0415

    objects, own = scene.objects, scene.rows_of_kind.take(rows)
    if objects.mesh_library is None:
        raise ValueError("rows name meshes, but the scene has no mesh library; valid: objects with their mesh_library")
    return nearest_mesh_pairs(
        points_m,
        objects.mesh_library,
        objects.mesh_index.take(own),
        objects.mesh_positions_m.take(own, axis=0),
        objects.mesh_rotations.take(own, axis=0),
    )


def object_distances(centers_m: FloatArray, radii_m: FloatArray, scene: SceneTable, reach_m: float) -> FloatArray:
    """Return each object's distance (k,) in m to the nearest of the spheres (m,); infinite beyond `reach_m`."""
    gaps: FloatArray = np.full(len(scene.objects.names), np.inf)
    spheres = np.concatenate([centers_m, radii_m[:, None]], axis=1)
    _least_gaps(
        spheres,
        around(spheres, np.array([0, len(spheres)]))[0],
        scene.bounds,
        scene.shapes,
        scene.kinds,
        scene.object_index,
        reach_m,
        gaps,
    )
    for row in np.flatnonzero(scene.kinds == MESH):
        least = np.linalg.norm(centers_m - scene.bounds[row, :3], axis=1) - radii_m - scene.bounds[row, 3]
        near = np.flatnonzero(least <= reach_m)
        if len(near):
            apart, _ = nearest_mesh_points(centers_m[near], scene, np.full(len(near), row))
            thing = scene.object_index[row]
            gaps[thing] = min(gaps[thing], float((apart - radii_m[near]).min()))
    return np.where(gaps <= reach_m, gaps, np.inf)


@compiled(
    *(input_array(2), input_array(1), input_array(2), input_array(2)),
    *(input_indices(), input_indices(), FLOAT64, output_array(1)),
)
def _least_gaps(
    spheres: FloatArray,
    whole: FloatArray,
    bounds: FloatArray,
    shapes: FloatArray,
    kinds: IntArray,
    objects: IntArray,
    reach: float,
    gaps: FloatArray,
) -> None:
    """Lower each object's gap (k,) to the least distance from the spheres to its primitives other than meshes.

    whole (4,): a sphere around the spheres. Primitives whose bounds are farther away than `reach` are skipped.
    """
    middle, size = (whole[0], whole[1], whole[2]), whole[3]
    for row in range(kinds.size):
        if kinds[row] == MESH or norm(subtract(load(bounds, row), middle)) - bounds[row, 3] - size > reach:
            continue
        for i in range(spheres.shape[0]):
            least = gaps[objects[row]]
            center = load(spheres, i)
            if norm(subtract(load(bounds, row), center)) - bounds[row, 3] - spheres[i, 3] <= min(reach, least):
                gap = nearest(kinds[row], shapes, row, center)[0] - spheres[i, 3]
                gaps[objects[row]] = min(least, gap)
