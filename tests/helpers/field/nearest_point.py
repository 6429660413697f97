"""Distances from points to the surfaces of primitives, by the compiled functions for nearest points.

Each function compares point i with primitive i only. `kinds.layout.Nearest` explains the result.
"""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import compiled, input_array, input_indices, output_array
from robot_side.compiled.vectors import load
from robot_side.surroundings.any_kind import nearest
from robot_side.surroundings.distances import nearest_mesh_points
from robot_side.surroundings.kinds.layout import BOX, HALF_SPACE, MESH, SPHERE, TETRAHEDRON, rows
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, scene_table
from tests.helpers.perceived_scenes import Scene

Nearest = tuple[FloatArray, FloatArray]
"""Signed distances (p,) in metres, and directions (p, 3)."""


@compiled(input_array(2), input_array(2), input_indices(), input_indices(), output_array(1), output_array(2))
def _nearest_loop(
    points: FloatArray,
    shapes: FloatArray,
    kinds: IntArray,
    rows: IntArray,
    distances: FloatArray,
    directions: FloatArray,
) -> None:
    for k in range(rows.size):
        if kinds[rows[k]] != MESH:
            distances[k], towards = nearest(kinds[rows[k]], shapes, rows[k], load(points, k))
            for axis in range(3):
                directions[k, axis] = towards[axis]


def nearest_points(points_m: FloatArray, scene: SceneTable, rows: IntArray) -> Nearest:
    """Return distances and directions from points (p, 3) to the primitives `rows` (p,) of a table."""
    distances, directions = np.empty(len(rows)), np.empty((len(rows), 3))
    points_m = np.ascontiguousarray(points_m)
    _nearest_loop(points_m, scene.shapes, scene.kinds, rows, distances, directions)
    meshes = np.flatnonzero(scene.kinds.take(rows) == MESH)
    if len(meshes):
        distances[meshes], directions[meshes] = nearest_mesh_points(points_m[meshes], scene, rows[meshes])
    return distances, directions


def distance_to_object(objects: PerceivedObjects, index: int, point_m: FloatArray) -> float:
    """Return the signed distance from `point_m` (3,) to an object: negative inside, infinite without primitives."""
    scene = scene_table(objects)
    rows = np.arange(scene.first_rows[index], scene.first_rows[index + 1])
    points = np.broadcast_to(np.asarray(point_m, dtype=np.float64), (len(rows), 3))
    return float(nearest_points(points, scene, rows)[0].min(initial=math.inf))


def nearest_on_sphere(points_m: FloatArray, centers_m: FloatArray, radii_m: FloatArray) -> Nearest:
    """Return distances and directions from points (p, 3) to spheres: centers (p, 3), radii (p,)."""
    return _each(SPHERE, points_m, centers_m, radii_m)


def nearest_on_box(
    points_m: FloatArray, centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray
) -> Nearest:
    """Return distances and directions from points (p, 3) to boxes.

    Boxes: centers (p, 3), rotations (p, 3, 3) from box to world, half sizes (p, 3).
    """
    return _each(BOX, points_m, centers_m, rotations, half_sizes_m)


def nearest_on_tetrahedron(points_m: FloatArray, vertices_m: FloatArray) -> Nearest:
    """Return distances and directions from points (p, 3) to tetrahedra (p, 4, 3), whose vertices are in any order.

    A tetrahedron of zero volume counts as a plate.
    """
    return _each(TETRAHEDRON, points_m, vertices_m)


def nearest_on_half_space(points_m: FloatArray, normals: FloatArray, offsets_m: FloatArray) -> Nearest:
    """Return distances and directions from points (p, 3) to half-spaces, which are solid where normal·x <= offset."""
    return _each(HALF_SPACE, points_m, normals, offsets_m)


def _each(kind: int, points_m: FloatArray, *columns: FloatArray) -> Nearest:
    """Compute with a table of only these primitives. It keeps those without volume, which `scene_table` leaves out."""
    count = len(points_m)
    places = np.arange(count)
    nothing = np.empty((0, 4))
    table = SceneTable(
        objects=Scene().objects(),
        bounds=nothing,
        shapes=rows(*(np.ascontiguousarray(column, dtype=np.float64) for column in columns)),
        kinds=np.full(count, kind),
        rows_of_kind=places,
        first_rows=np.zeros(1, dtype=np.int64),
        object_bounds=nothing,
        object_volumes=np.empty(0),
        flat=0,
    )
    return nearest_points(np.asarray(points_m, dtype=np.float64), table, places)
