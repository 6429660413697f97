"""The ways of §4.2 straight from their definition: the overlaps on a fine grid of ways, and nothing clever."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap import MeshLibrary, sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron
from robot_side.overlap.meshes.mesh_library import mesh_pairs

STEP_M = 5e-5
_NOTHING = 1e-9


@dataclass(frozen=True)
class Definition:
    """What the ways are defined by."""

    objects: PerceivedObjects
    direction: FloatArray
    reach_m: float
    margin_m: float = 0.012
    least_depth_m: float = 0.0005

    def ways(
        self,
        centers_m: FloatArray,
        radii_m: FloatArray,
        inflated_m: FloatArray,
        slacks: Sequence[float] = (0.0,),
    ) -> FloatArray:
        """The eight ways (k, 8) of spheres (m,) that are inflated by `inflated_m` (m,); infinite beyond the reach.

        slacks (k,): by so much more than its own strength, of 1, each must be reached.
        """
        ways = np.full((len(slacks), 8), np.inf)
        for center, radius, inflated in zip(centers_m, radii_m, inflated_m, strict=True):
            for thing in range(len(self.objects.names)):
                found, touching = self._pair(center, radius + inflated, thing, slacks)
                ways = np.minimum(ways, found)
                if touching:
                    bare, _ = self._pair(center, radius, thing, slacks)
                    ways = np.minimum(ways, bare - inflated)
        return np.where(ways <= self.reach_m, ways, np.inf)

    def _pair(self, center: FloatArray, radius: float, thing: int, slacks: Sequence[float]) -> tuple[FloatArray, bool]:
        """The ways of one sphere and one object, and whether they overlap at the start."""
        along = np.arange(0.0, self.reach_m + self.margin_m + STEP_M, STEP_M)
        overlap, leaning = overlap_of(center + along[:, None] * self.direction, radius, self.objects, thing)
        ways = np.full((len(slacks), 8), np.inf)
        grown = np.maximum.accumulate(np.maximum(overlap - overlap[0], 0.0))
        rises = grown > _NOTHING * overlap.max()
        if rises.any():
            free = max(int(np.argmax(rises)) - 1, 0)
            full = min(free + round(self.margin_m / STEP_M), len(along) - 1)
            least = min(np.pi * radius * self.least_depth_m**2, 0.5 * volume_of(self.objects, thing))
            strengths = grown / max(grown[full], self.margin_m * leaning, least)
            for row, slack in enumerate(slacks):
                for level in range(8):
                    there = strengths >= (level + 0.5) / 8 + slack
                    if there.any():
                        ways[row, level] = along[int(np.argmax(there))] - self.margin_m
        return ways, bool(overlap[0] > 0.0)


def overlap_of(path_m: FloatArray, radius_m: float, objects: PerceivedObjects, thing: int) -> tuple[FloatArray, float]:
    """V (k,) of a sphere at each point of `path_m` (k, 3) with the object `thing`, and |∇V| at the first."""
    total, push = np.zeros(len(path_m)), np.zeros(3)
    radii = np.full(len(path_m), radius_m)
    for own, function, arrays in (
        (objects.sphere_object, sphere_sphere, (objects.sphere_centers_m, objects.sphere_radii_m)),
        (objects.box_object, sphere_box, (objects.box_centers_m, objects.box_rotations, objects.box_half_sizes_m)),
        (objects.tetrahedron_object, sphere_tetrahedron, (objects.tetrahedron_vertices_m,)),
        (objects.half_space_object, sphere_half_space, (objects.half_space_normals, objects.half_space_offsets_m)),
    ):
        for row in np.flatnonzero(own == thing):
            primitive = (np.broadcast_to(array[row], (len(path_m), *array[row].shape)) for array in arrays)
            volumes, gradients, _ = function(path_m, radii, *primitive, gradient=True)
            total, push = total + volumes, push + gradients[0]
    for row in np.flatnonzero(objects.mesh_object == thing):
        same = np.full(len(path_m), row)
        volumes, gradients, _ = mesh_pairs(
            path_m,
            radii,
            required(objects.mesh_library),
            objects.mesh_index[same],
            objects.mesh_positions_m[same],
            objects.mesh_rotations[same],
        )
        total, push = total + volumes, push + gradients[0]
    return total, float(np.linalg.norm(push))


def required(library: MeshLibrary | None) -> MeshLibrary:
    assert library is not None
    return library


def volume_of(objects: PerceivedObjects, thing: int) -> float:
    """V_J in m³."""
    edges = objects.tetrahedron_vertices_m[:, 1:] - objects.tetrahedron_vertices_m[:, :1]
    tetrahedra = np.abs(np.linalg.det(edges)) / 6.0
    total = (4.0 / 3.0 * np.pi * objects.sphere_radii_m**3)[objects.sphere_object == thing].sum()
    total += (8.0 * objects.box_half_sizes_m.prod(axis=1))[objects.box_object == thing].sum()
    total += tetrahedra[objects.tetrahedron_object == thing].sum()
    if objects.mesh_library is not None:
        total += objects.mesh_library.tables.volumes[objects.mesh_index][objects.mesh_object == thing].sum()
    return float("inf") if (objects.half_space_object == thing).any() else float(total)
