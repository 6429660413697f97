"""Pairs of a sphere and a solid, in the arrays that every method of the overlap benchmark gets."""

from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from common.arrays import FloatArray, IntArray

Solid = Literal["tetrahedron", "box", "half-space", "sphere"]

TETRAHEDRON_TRIANGLES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))
"""Vertices of each face, anticlockwise from outside if right-handed: det(v1 - v0, v2 - v0, v3 - v0) > 0."""

BOX_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))
"""Corners (8, 3) in units of the half sizes, the last axis changing first."""

BOX_QUADRILATERALS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
"""Corners of each face in `BOX_SIGNS`, anticlockwise from outside for a right-handed box."""


@dataclass(frozen=True)
class Pairs:
    """Spheres `centers` (p, 3), `radii` (p,) in m, and a solid of one kind for each.

    `parameters` are the solid's arguments in the order of the public function: vertices (p, 4, 3); box centres
    (p, 3), rotations (p, 3, 3) and half sizes (p, 3); normals (p, 3) and offsets (p,); or other centres (p, 3)
    and other radii (p,).
    """

    solid: Solid
    centers: FloatArray
    radii: FloatArray
    parameters: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        # The kernels take contiguous arrays of float64 only.
        object.__setattr__(self, "centers", np.ascontiguousarray(self.centers, float))
        object.__setattr__(self, "radii", np.ascontiguousarray(self.radii, float))
        object.__setattr__(self, "parameters", tuple(np.ascontiguousarray(p, float) for p in self.parameters))

    def __len__(self) -> int:
        return len(self.radii)

    def __getitem__(self, rows: slice | IntArray) -> "Pairs":
        """Return the pairs of these rows."""
        return Pairs(self.solid, self.centers[rows], self.radii[rows], tuple(p[rows] for p in self.parameters))

    @property
    def arguments(self) -> tuple[FloatArray, ...]:
        """Arguments of the public function, and of the kernel."""
        return self.centers, self.radii, *self.parameters

    @property
    def sphere_volumes(self) -> FloatArray:
        """Volumes (p,) of the spheres in m³."""
        return np.asarray(4.0 / 3.0 * np.pi * self.radii**3)

    @property
    def corners(self) -> FloatArray:
        """Corners (p, 4 or 8, 3) of tetrahedra or boxes in m, the latter rounded to doubles."""
        if self.solid == "tetrahedron":
            return self.parameters[0]
        if self.solid == "box":
            centers, rotations, half_sizes = self.parameters
            offsets = np.einsum("nij,nkj->nki", rotations, BOX_SIGNS * half_sizes[:, None])
            return np.asarray(centers[:, None] + offsets)
        raise ValueError(f"solid = {self.solid!r} has no corners; valid: tetrahedron, box")

    @property
    def solid_volumes(self) -> FloatArray:
        """Volumes (p,) of the solids in m³, rounded; infinite for half-spaces."""
        if self.solid == "tetrahedron":
            edges = self.parameters[0][:, 1:] - self.parameters[0][:, :1]
            return np.asarray(np.abs(np.linalg.det(edges)) / 6.0)
        if self.solid == "box":
            return np.asarray(8.0 * self.parameters[2].prod(axis=1) * np.abs(np.linalg.det(self.parameters[1])))
        if self.solid == "sphere":
            return np.asarray(4.0 / 3.0 * np.pi * self.parameters[1] ** 3)
        return np.full(len(self), np.inf)
