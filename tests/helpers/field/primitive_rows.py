"""Reference for the rows of a scene's table, computed from the definitions in NumPy, one primitive at a time."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.surroundings.kinds.layout import BOX, HALF_SPACE, MESH, SHAPE_NUMBERS, SPHERE, TETRAHEDRON
from robot_side.surroundings.perceived import PerceivedObjects


@dataclass(frozen=True)
class Row:
    """Row of one primitive in a scene's table."""

    thing: int
    kind: int
    row_of_kind: int
    shape: FloatArray
    """Numbers that describe the primitive, padded with zeros (15,)"""
    bound: FloatArray
    """Centre and radius of a sphere that contains the primitive (4,)"""
    volume_m3: float


def rows_of(objects: PerceivedObjects) -> list[Row]:
    """Return the rows of all primitives that have a volume, sorted by object and then by kind."""
    found = [*_spheres(objects), *_boxes(objects), *_tetrahedra(objects), *_half_spaces(objects), *_meshes(objects)]
    return sorted((row for row in found if row.volume_m3 > 0.0), key=lambda row: (row.thing, row.kind, row.row_of_kind))


def object_bound(rows: list[Row]) -> FloatArray:
    """Return centre and radius (4,) of a sphere that contains one object.

    The centre is the middle of the smallest box around the bounding spheres of `rows`.
    """
    if not rows:
        return np.array([0.0, 0.0, 0.0, -np.inf])
    bounds = np.array([row.bound for row in rows])
    if np.isinf(bounds[:, 3]).any():
        return np.array([0.0, 0.0, 0.0, np.inf])
    low, high = (bounds[:, :3] - bounds[:, 3:]).min(axis=0), (bounds[:, :3] + bounds[:, 3:]).max(axis=0)
    middle = 0.5 * (low + high)
    return np.append(middle, (np.linalg.norm(bounds[:, :3] - middle, axis=1) + bounds[:, 3]).max())


def _row(thing: int, kind: int, k: int, shape: list[FloatArray], bound: tuple[FloatArray, float], volume: float) -> Row:
    numbers = np.concatenate([np.ravel(part) for part in shape])
    padded = np.append(numbers, np.zeros(SHAPE_NUMBERS - len(numbers)))
    return Row(thing, kind, k, padded, np.append(*bound), volume)


def _spheres(objects: PerceivedObjects) -> list[Row]:
    return [
        _row(int(thing), SPHERE, k, [center, radius], (center, radius), 4.0 / 3.0 * np.pi * radius**3)
        for k, (thing, center, radius) in enumerate(
            zip(objects.sphere_object, objects.sphere_centers_m, objects.sphere_radii_m, strict=True)
        )
    ]


def _boxes(objects: PerceivedObjects) -> list[Row]:
    found = []
    for k, thing in enumerate(objects.box_object):
        center, rotation, half = objects.box_centers_m[k], objects.box_rotations[k], objects.box_half_sizes_m[k]
        bound = center, float(np.linalg.norm(half))
        found.append(_row(int(thing), BOX, k, [center, rotation, half], bound, 8.0 * float(half.prod())))
    return found


def _tetrahedra(objects: PerceivedObjects) -> list[Row]:
    found = []
    for k, thing in enumerate(objects.tetrahedron_object):
        vertices = objects.tetrahedron_vertices_m[k]
        middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        bound = middle, float(np.linalg.norm(vertices - middle, axis=1).max())
        volume = abs(float(np.linalg.det(vertices[1:] - vertices[0]))) / 6.0
        found.append(_row(int(thing), TETRAHEDRON, k, [vertices], bound, volume))
    return found


def _half_spaces(objects: PerceivedObjects) -> list[Row]:
    return [
        _row(int(thing), HALF_SPACE, k, [normal, offset], (np.zeros(3), np.inf), np.inf)
        for k, (thing, normal, offset) in enumerate(
            zip(objects.half_space_object, objects.half_space_normals, objects.half_space_offsets_m, strict=True)
        )
    ]


def _meshes(objects: PerceivedObjects) -> list[Row]:
    found = []
    for k, thing in enumerate(objects.mesh_object):
        assert objects.mesh_library is not None
        corners = objects.mesh_library.corners_m[objects.mesh_index[k]]
        rotation = objects.mesh_rotations[k]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        middle = objects.mesh_positions_m[k] + rotation @ (0.5 * (low + high))
        radius = float(np.linalg.norm(corners - 0.5 * (low + high), axis=2).max())
        volume = abs(float(np.linalg.det(corners).sum())) / 6.0
        found.append(_row(int(thing), MESH, k, [middle, rotation, 0.5 * (high - low)], (middle, radius), volume))
    return found
