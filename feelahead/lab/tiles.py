"""Synthetic maps of surfaces as a depth camera's would be: many thin boxes, each an object of its own."""

from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from common.roles import Role
from robot_side.surroundings.perceived import PerceivedObjects

_THICK_M: Final = 0.02
_HEAP: Final = 60
"""Number of boxes of a round object on a table, of which a camera sees the upper half"""


class Tiling(NamedTuple):
    """How a flat surface is cut into boxes."""

    tile_m: float
    """Distance between the middles of neighbouring tiles"""
    roughness_m: float = 0.0
    """Distance by which a tile's face is at most before or behind the true plane; each is drawn evenly"""
    gap_m: float = 0.0
    """Width of the gap between neighbouring tiles"""


class Boxes(NamedTuple):
    """Boxes {c + Q diag(half) x : |x_i| <= 1} in the world frame."""

    centers_m: FloatArray
    """(n, 3)"""
    rotations: FloatArray
    """(n, 3, 3) box to world"""
    half_sizes_m: FloatArray
    """(n, 3)"""

    def and_also(self, *others: "Boxes") -> "Boxes":
        """Return these boxes, then the others."""
        return Boxes._make(np.concatenate(columns) for columns in zip(self, *others, strict=True))

    def objects(self) -> PerceivedObjects:
        """Return a frame in which each box is an object."""
        count, none = len(self.centers_m), np.empty(0, dtype=np.int64)
        return PerceivedObjects(
            time_s=0.0,
            names=tuple(f"tile {k}" for k in range(count)),
            roles=(Role.OBSTACLE,) * count,
            sphere_centers_m=np.empty((0, 3)),
            sphere_radii_m=np.empty(0),
            sphere_object=none,
            box_centers_m=self.centers_m,
            box_rotations=self.rotations,
            box_half_sizes_m=self.half_sizes_m,
            box_object=np.arange(count),
            tetrahedron_vertices_m=np.empty((0, 4, 3)),
            tetrahedron_object=none,
            half_space_normals=np.empty((0, 3)),
            half_space_offsets_m=np.empty(0),
            half_space_object=none,
        )


def frame_at(normal: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) whose third column is the unit vector `normal` (3,)."""
    first = np.cross(np.eye(3)[np.abs(normal).argmin()], normal)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(normal, first), normal])


def flat(middle_m: FloatArray, normal: FloatArray, size_m: tuple[float, float]) -> Boxes:
    """Return one box: a plate with the middle of its face at `middle_m` (3,), which looks along `normal` (3,)."""
    half_m = 0.5 * np.array([[*size_m, _THICK_M]])
    return Boxes((middle_m - 0.5 * _THICK_M * normal)[None], frame_at(normal)[None], half_m)


def tiled(
    middle_m: FloatArray, normal: FloatArray, size_m: tuple[float, float], tiling: Tiling, seed: int = 0
) -> Boxes:
    """Return the plate of `flat` as tiles. A tile that fits only in part is left whole, so the plate may grow by it."""
    rotation, random = frame_at(normal), np.random.default_rng(seed)
    counts = [int(np.ceil(size / tiling.tile_m - 1e-9)) for size in size_m]
    places = [(np.arange(count) - 0.5 * (count - 1)) * tiling.tile_m for count in counts]
    aside_m = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 2)
    out_m = random.uniform(-tiling.roughness_m, tiling.roughness_m, len(aside_m)) - 0.5 * _THICK_M
    half_m = 0.5 * np.array([tiling.tile_m - tiling.gap_m, tiling.tile_m - tiling.gap_m, _THICK_M])
    count = len(aside_m)
    centers_m = middle_m + np.column_stack([aside_m, out_m]) @ rotation.T
    return Boxes(centers_m, np.tile(rotation, (count, 1, 1)), np.tile(half_m, (count, 1)))


def cluttered_table(top_m: FloatArray, size_m: tuple[float, float], tiling: Tiling, count: int, seed: int = 0) -> Boxes:
    """Return a table, its top at `top_m` (3,), and on it heaps of small tilted boxes, `count` boxes in all.

    The table's tiles are four times as large as those of the heaps, as a flat surface needs fewer.
    """
    up, random = np.array([0.0, 0.0, 1.0]), np.random.default_rng(seed)
    table = tiled(top_m, up, size_m, tiling._replace(tile_m=4.0 * tiling.tile_m), seed)
    left = max(count - len(table.centers_m), 0)
    heaps = -(-left // _HEAP)
    middles_m = top_m + np.column_stack([random.uniform(-0.4, 0.4, (heaps, 2)) * size_m, np.zeros(heaps)])
    outwards = random.normal(size=(left, 3))
    outwards[:, 2] = np.abs(outwards[:, 2])
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    radii_m = np.repeat(random.uniform(0.03, 0.07, heaps), _HEAP)[:left]
    faces_m = np.repeat(middles_m, _HEAP, axis=0)[:left] + radii_m[:, None] * outwards
    half_m = 0.5 * np.array([tiling.tile_m, tiling.tile_m, _THICK_M])
    rotations = np.array([frame_at(outward) for outward in outwards])
    heaped = Boxes(faces_m - 0.5 * _THICK_M * outwards, rotations, np.tile(half_m, (left, 1)))
    return table.and_also(heaped)
