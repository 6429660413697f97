"""How far a point is from an object, whatever the object is made of."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.nearest_point import (
    nearest_on_box,
    nearest_on_half_space,
    nearest_on_sphere,
    nearest_on_tetrahedron,
)
from robot_side.perceived_objects import PerceivedObjects


def distance_to_object(objects: PerceivedObjects, index: int, point_m: FloatArray) -> float:
    """Signed distance in metres from `point_m` (3,) to the surface of the object `index`, negative inside.

    Infinite for an object without primitives, as an ignored one.
    """
    nearest_m = math.inf
    for rows, nearest, primitives in (
        (objects.sphere_object == index, nearest_on_sphere, (objects.sphere_centers_m, objects.sphere_radii_m)),
        (
            objects.box_object == index,
            nearest_on_box,
            (objects.box_centers_m, objects.box_rotations, objects.box_half_sizes_m),
        ),
        (objects.tetrahedron_object == index, nearest_on_tetrahedron, (objects.tetrahedron_vertices_m,)),
        (
            objects.half_space_object == index,
            nearest_on_half_space,
            (objects.half_space_normals, objects.half_space_offsets_m),
        ),
    ):
        count = int(np.count_nonzero(rows))
        if count > 0:
            points = np.broadcast_to(point_m, (count, 3))
            distance, _ = nearest(points, *(array[rows] for array in primitives))
            nearest_m = min(nearest_m, float(distance.min()))
    return nearest_m
