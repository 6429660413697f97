"""How far a point is from an object, whatever the object is made of."""

import numpy as np

from common.arrays import FloatArray
from robot_side.objects.perceived import PerceivedObjects
from robot_side.pairs.nearest_kernels import object_distance


def distance_to_object(objects: PerceivedObjects, index: int, point_m: FloatArray) -> float:
    """Signed distance in metres from `point_m` (3,) to the surface of the object `index`, negative inside.

    Infinite for an object without primitives, as an ignored one.
    """
    distance_m: float = object_distance(
        np.ascontiguousarray(point_m).reshape(1, 3),
        index,
        objects.sphere_object,
        objects.sphere_centers_m,
        objects.sphere_radii_m,
        objects.box_object,
        objects.box_centers_m,
        objects.box_rotations,
        objects.box_half_sizes_m,
        objects.tetrahedron_object,
        objects.tetrahedron_vertices_m,
        objects.half_space_object,
        objects.half_space_normals,
        objects.half_space_offsets_m,
    )
    rows = np.flatnonzero(objects.mesh_object == index)
    if len(rows) and objects.mesh_library is not None:
        # A scene without meshes does not load the kernels for them.
        from robot_side.overlap.meshes.mesh_library import nearest_mesh_pairs  # noqa: PLC0415

        points = np.repeat(np.ascontiguousarray(point_m, dtype=np.float64).reshape(1, 3), len(rows), axis=0)
        to_meshes, _ = nearest_mesh_pairs(
            points,
            objects.mesh_library,
            objects.mesh_index.take(rows),
            objects.mesh_positions_m.take(rows, axis=0),
            objects.mesh_rotations.take(rows, axis=0),
        )
        distance_m = min(distance_m, float(to_meshes.min()))
    return distance_m
