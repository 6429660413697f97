"""Overlaps of spheres with a frame's objects, and distances to them, computed by public functions only."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.overlap import sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron
from robot_side.overlap.meshes.mesh_library import nearest_mesh_pairs
from robot_side.overlap.meshes.mesh_pairs import mesh_pairs
from robot_side.surroundings.kinds.ellipsoid import overlap_one_ellipsoid
from robot_side.surroundings.kinds.layout import rows
from robot_side.surroundings.perceived import PerceivedObjects

_STEPS: Final = 24
_NEAR_M: Final = 1e-4
_ROUNDING_M: Final = 1e-6


@dataclass(frozen=True)
class _Kind:
    """All primitives of one kind in a frame, sorted by object."""

    owner: IntArray
    columns: tuple[FloatArray | IntArray, ...]
    volumes_m3: FloatArray
    overlap: Callable[..., tuple[FloatArray, ...]]
    """Function from spheres (n, 3), (n,) and columns to V (n,) and gradients (n, 3)."""
    distance: Callable[..., FloatArray]
    """Function from points (n, 3) and columns to lower bounds (n,) of the distances; any value inside."""

    def of(self, things: IntArray) -> tuple[IntArray, list[FloatArray | IntArray]]:
        """Return for each primitive (q,) of `things` (n,) its place among them, and its columns."""
        first, end = np.searchsorted(self.owner, things, "left"), np.searchsorted(self.owner, things, "right")
        place = np.repeat(np.arange(len(things)), end - first)
        row = np.arange(len(place)) - np.repeat(np.cumsum(end - first) - end, end - first)
        return place, [column[row] for column in self.columns]


class Solids:
    """All objects of a frame."""

    def __init__(self, seen: PerceivedObjects) -> None:
        self._kinds = [kind for kind in _kinds_of(seen) if len(kind.owner)]
        self.volumes_m3: FloatArray = np.zeros(len(seen.names))
        """(k,) V_J, volume of each object"""
        for kind in self._kinds:
            np.add.at(self.volumes_m3, kind.owner, kind.volumes_m3)

    def overlap(self, centers: FloatArray, radii: FloatArray, things: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return V (n,) and gradients (n, 3) of spheres, each with its object."""
        volumes, gradients = np.zeros(len(radii)), np.zeros((len(radii), 3))
        for kind in self._kinds:
            place, columns = kind.of(things)
            if not len(place):
                continue
            found, leaning, *_ = kind.overlap(centers[place], radii[place], *columns)
            volumes += np.bincount(place, found, len(radii))
            for axis in range(3):
                gradients[:, axis] += np.bincount(place, leaning[:, axis], len(radii))
        return volumes, gradients

    def first_touch_m(
        self, centers: FloatArray, radii: FloatArray, things: IntArray, direction: FloatArray, end_m: FloatArray
    ) -> FloatArray:
        """Return lower bounds (n,) of how far each sphere moves before it touches its object; rough beyond `end_m`."""
        moved_m = np.zeros(len(radii))
        going = np.arange(len(radii))
        for _ in range(_STEPS):
            gap_m = self.distance_m(centers[going] + moved_m[going, None] * direction, things[going]) - radii[going]
            moved_m[going] += np.maximum(gap_m, 0.0)
            going = going[(gap_m > _NEAR_M) & (moved_m[going] <= end_m[going])]
            if not len(going):
                break
        return np.maximum(moved_m - _ROUNDING_M, 0.0)

    def distance_m(self, points: FloatArray, things: IntArray) -> FloatArray:
        """Return lower bounds (n,) of the distances of points from their objects; any value up to 0 inside a box."""
        nearest = np.full(len(points), np.inf)
        for kind in self._kinds:
            place, columns = kind.of(things)
            if len(place):
                np.minimum.at(nearest, place, kind.distance(points[place], *columns))
        return nearest


def _kinds_of(seen: PerceivedObjects) -> list[_Kind]:
    corners, library = seen.tetrahedron_vertices_m, seen.mesh_library
    tetrahedra = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    spheres, boxes = seen.sphere_centers_m, seen.box_centers_m
    balls, bricks = 4.0 / 3.0 * np.pi * seen.sphere_radii_m**3, 8.0 * seen.box_half_sizes_m.prod(axis=1)
    walls, endless = seen.half_space_normals, np.full(len(seen.half_space_object), np.inf)
    box, wall = (boxes, seen.box_rotations, seen.box_half_sizes_m), (walls, seen.half_space_offsets_m)
    eggs = (seen.ellipsoid_centers_m, seen.ellipsoid_rotations, seen.ellipsoid_half_axes_m)
    eggs_m3 = 4.0 / 3.0 * np.pi * seen.ellipsoid_half_axes_m.prod(axis=1)
    kinds = [
        _kind(seen.sphere_object, (spheres, seen.sphere_radii_m), balls, _public(sphere_sphere), _to_sphere),
        _kind(seen.box_object, box, bricks, _public(sphere_box), _to_box),
        _kind(seen.tetrahedron_object, (corners,), tetrahedra, _public(sphere_tetrahedron), _to_planes),
        _kind(seen.half_space_object, wall, endless, _public(sphere_half_space), _to_half_space),
        _kind(seen.ellipsoid_object, eggs, eggs_m3, _ellipsoids, _to_ellipsoid),
    ]
    if library is not None:
        mesh, volumes = (seen.mesh_index, seen.mesh_positions_m, seen.mesh_rotations), library.tables.volumes
        kinds.append(
            _kind(
                seen.mesh_object,
                mesh,
                volumes[seen.mesh_index],
                lambda centers, radii, *placed: mesh_pairs(centers, radii, library.tables, *placed),
                lambda points, *placed: nearest_mesh_pairs(points, library, *placed)[0],
            )
        )
    return kinds


def _kind(
    owner: IntArray,
    columns: tuple[FloatArray | IntArray, ...],
    volumes_m3: FloatArray,
    overlap: Callable[..., tuple[FloatArray, ...]],
    distance: Callable[..., FloatArray],
) -> _Kind:
    order = np.argsort(owner, kind="stable")
    return _Kind(owner[order], tuple(column[order] for column in columns), volumes_m3[order], overlap, distance)


def _public(overlap: Callable[..., tuple[FloatArray, ...]]) -> Callable[..., tuple[FloatArray, ...]]:
    return partial(overlap, gradient=True)


def _ellipsoids(centers: FloatArray, radii: FloatArray, *placed: FloatArray) -> tuple[FloatArray, ...]:
    volumes, gradients, nowhere = np.zeros(len(radii)), np.zeros((len(radii), 3)), np.zeros((1, 2), dtype=np.int64)
    shapes = rows(*placed)
    for k, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        volumes[k] = overlap_one_ellipsoid(shapes, k, *center, radius, nowhere, gradients[k])
    return volumes, gradients


def _to_half_space(points: FloatArray, normals: FloatArray, offsets: FloatArray) -> FloatArray:
    distances: FloatArray = np.einsum("ni,ni->n", points, normals) - offsets
    return distances


def _to_sphere(points: FloatArray, centers: FloatArray, radii: FloatArray) -> FloatArray:
    distances: FloatArray = np.linalg.norm(points - centers, axis=1) - radii
    return distances


def _to_box(points: FloatArray, centers: FloatArray, rotations: FloatArray, half_sizes: FloatArray) -> FloatArray:
    beyond = np.abs(np.einsum("nij,ni->nj", rotations, points - centers)) - half_sizes
    distances: FloatArray = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return distances


def _to_ellipsoid(points: FloatArray, centers: FloatArray, rotations: FloatArray, half_axes: FloatArray) -> FloatArray:
    """Return a lower bound of the distance: the depth in the unit ball's frame, by the least half axis."""
    scaled = np.einsum("nij,ni->nj", rotations, points - centers) / half_axes
    distances: FloatArray = (np.linalg.norm(scaled, axis=1) - 1.0) * half_axes.min(axis=1)
    return distances


def _to_planes(points: FloatArray, vertices: FloatArray) -> FloatArray:
    """Return the largest distance to the four planes of tetrahedra: a lower bound of the distance."""
    distances = np.full(len(points), -np.inf)
    for corner in range(4):
        face = vertices[:, [k for k in range(4) if k != corner]]
        normals = np.cross(face[:, 1] - face[:, 0], face[:, 2] - face[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        inwards = np.einsum("ni,ni->n", normals, vertices[:, corner] - face[:, 0])
        distances = np.maximum(distances, -np.sign(inwards) * np.einsum("ni,ni->n", normals, points - face[:, 0]))
    return distances
