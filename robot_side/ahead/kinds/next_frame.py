"""The rows of a scene table where the same objects are now: in one pass, for every new frame of a camera."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.ahead.kinds.layout import BOX, HALF_SPACE, SHAPE_NUMBERS, SPHERE, TETRAHEDRON, rows
from robot_side.compiled.kernel import (
    TRUTH,
    compiled,
    inlined,
    input_array,
    input_indices,
    output_array,
)
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract
from robot_side.objects.mesh_bounds import mesh_bounds, placed_middles
from robot_side.objects.perceived import PerceivedObjects


@inlined
def _place_sphere(centers: FloatArray, radii: FloatArray, k: int, shape: FloatArray, bound: FloatArray) -> float:
    """Write one sphere's numbers and bounds; its volume, as all of these do."""
    for axis in range(3):
        shape[axis] = bound[axis] = centers[k, axis]
    shape[3] = bound[3] = radii[k]
    return 4.0 / 3.0 * math.pi * float(radii[k] ** 3)


@inlined
def _place_box(
    centers: FloatArray, rotations: FloatArray, half_sizes: FloatArray, k: int, shape: FloatArray, bound: FloatArray
) -> float:
    half = load(half_sizes, k)
    for axis in range(3):
        shape[axis] = bound[axis] = centers[k, axis]
        shape[12 + axis] = half_sizes[k, axis]
        for column in range(3):
            shape[3 + 3 * axis + column] = rotations[k, axis, column]
    bound[3] = norm(half)
    return 8.0 * (half[0] * half[1] * half[2])


@inlined
def _place_tetrahedron(vertices: FloatArray, k: int, shape: FloatArray, bound: FloatArray) -> float:
    for corner in range(4):
        for axis in range(3):
            shape[3 * corner + axis] = vertices[k, corner, axis]
    for axis in range(3):
        low, high = vertices[k, :, axis].min(), vertices[k, :, axis].max()
        bound[axis] = 0.5 * (low + high)
    middle: Vector = (bound[0], bound[1], bound[2])
    bound[3] = 0.0
    for corner in range(4):
        bound[3] = max(bound[3], norm(subtract(load(vertices[k], corner), middle)))
    first = load(vertices[k], 0)
    a, b, c = (
        subtract(load(vertices[k], 1), first),
        subtract(load(vertices[k], 2), first),
        subtract(load(vertices[k], 3), first),
    )
    return abs(dot(cross(a, b), c)) / 6.0


@inlined
def _place_half_space(normals: FloatArray, offsets: FloatArray, k: int, shape: FloatArray, bound: FloatArray) -> float:
    for axis in range(3):
        shape[axis], bound[axis] = normals[k, axis], 0.0
    shape[3], bound[3] = offsets[k], math.inf
    return math.inf


@inlined
def write_around(bounds: FloatArray, first: int, end: int, around: FloatArray) -> None:
    """Write a sphere around the bounds from `first` to `end`; of radius -inf where there are none."""
    around[:3], around[3] = 0.0, -math.inf
    low, high = (math.inf, math.inf, math.inf), (-math.inf, -math.inf, -math.inf)
    for row in range(first, end):
        x, y, z, size = bounds[row, 0], bounds[row, 1], bounds[row, 2], bounds[row, 3]
        low = min(low[0], x - size), min(low[1], y - size), min(low[2], z - size)
        high = max(high[0], x + size), max(high[1], y + size), max(high[2], z + size)
    if first < end and high[0] < math.inf:
        middle = scale(0.5, add(low, high))
        around[0], around[1], around[2] = middle
    for row in range(first, end):
        middle = around[0], around[1], around[2]
        around[3] = max(around[3], norm(subtract(load(bounds, row), middle)) + bounds[row, 3])


@compiled(
    *(input_array(2), input_array(1), input_array(2), input_array(3), input_array(2), input_array(3)),
    *(input_array(2), input_array(1), input_array(2), input_array(2), input_array(1)),
    *(input_indices(), input_indices(), input_indices()),
    *(output_array(2), output_array(2), output_array(2), output_array(1)),
    returns=TRUTH,
)
def place(
    sphere_centers: FloatArray,
    sphere_radii: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    vertices: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
    mesh_shapes: FloatArray,
    mesh_bounds: FloatArray,
    mesh_volumes: FloatArray,
    kinds: IntArray,
    rows_of_kind: IntArray,
    first_rows: IntArray,
    bounds: FloatArray,
    shapes: FloatArray,
    object_bounds: FloatArray,
    object_volumes: FloatArray,
) -> bool:
    """Fill the last four as SceneTable has them, for rows of these kinds; False if one has no volume.

    The first eight as PerceivedObjects has them; mesh_shapes (q, 15), mesh_bounds (q, 4), mesh_volumes (q,): of the
    boxes around meshes, where these are now, and of the meshes.
    """
    shapes[:], object_volumes[:], solid = 0.0, 0.0, True
    for thing in range(first_rows.size - 1):
        for row in range(first_rows[thing], first_rows[thing + 1]):
            kind, k, shape, bound = kinds[row], rows_of_kind[row], shapes[row], bounds[row]
            if kind == BOX:
                volume = _place_box(box_centers, box_rotations, box_half_sizes, k, shape, bound)
            elif kind == TETRAHEDRON:
                volume = _place_tetrahedron(vertices, k, shape, bound)
            elif kind == SPHERE:
                volume = _place_sphere(sphere_centers, sphere_radii, k, shape, bound)
            elif kind == HALF_SPACE:
                volume = _place_half_space(normals, offsets, k, shape, bound)
            else:
                shape[:], bound[:], volume = mesh_shapes[k], mesh_bounds[k], mesh_volumes[k]
            solid = solid and volume > 0.0
            object_volumes[thing] += volume
        write_around(bounds, first_rows[thing], first_rows[thing + 1], object_bounds[thing])
    return solid


def room(rows: int, objects: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What `place` fills."""
    return np.empty((rows, 4)), np.empty((rows, 15)), np.empty((objects, 4)), np.empty(objects)


def given(objects: PerceivedObjects) -> tuple[np.ndarray, ...]:
    """What `place` reads of a frame: its first eleven arguments."""
    return (
        *(objects.sphere_centers_m, objects.sphere_radii_m),
        *(objects.box_centers_m, objects.box_rotations, objects.box_half_sizes_m, objects.tetrahedron_vertices_m),
        *(objects.half_space_normals, objects.half_space_offsets_m),
        *(_mesh_boxes(objects), _mesh_spheres(objects), mesh_volumes(objects)),
    )


def mesh_volumes(objects: PerceivedObjects) -> FloatArray:
    """(q,) in m³"""
    if objects.mesh_library is None:
        return np.empty(0)
    return objects.mesh_library.tables.volumes.take(objects.mesh_index)


def _mesh_boxes(objects: PerceivedObjects) -> FloatArray:
    if objects.mesh_library is None:
        return np.zeros((0, SHAPE_NUMBERS))
    half_sizes_m = mesh_bounds(objects.mesh_library).half_sizes_m.take(objects.mesh_index, axis=0)
    return rows(placed_middles(objects), objects.mesh_rotations, half_sizes_m)


def _mesh_spheres(objects: PerceivedObjects) -> FloatArray:
    if objects.mesh_library is None:
        return np.empty((0, 4))
    radii = mesh_bounds(objects.mesh_library).radii_m.take(objects.mesh_index)
    return np.column_stack([placed_middles(objects), radii])
