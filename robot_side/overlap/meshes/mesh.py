"""Exact overlap of spheres with closed triangle meshes, convex or not (eq. 11 and 12)."""

import functools
from typing import Literal, overload

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray, IntArray
from robot_side.overlap.checks.arguments import broadcast, lengths, numbers
from robot_side.overlap.meshes.closed_surface import (
    checked_triangles,
    checked_vertices,
    components,
    merged,
    require_all_different,
    require_closed,
    require_outward,
    signed_volume,
)
from robot_side.overlap.meshes.mesh_tables import mesh_tables
from robot_side.overlap.solids.solid import Overlaps

Array = npt.ArrayLike

_IN_PLACE = np.zeros(1, dtype=np.int64), np.zeros((1, 3)), np.eye(3)[None]
"""Arguments index, position and rotation that leave a single mesh in its own frame"""


class Mesh:
    """Solid bounded by triangles, prepared once for many queries; immutable.

    `vertices` (v, 3) in m. `triangles` (t, 3): indices of three vertices each, anticlockwise as seen from outside.
    Vertices with equal coordinates count as one. Every edge must be used equally often in both directions. A triangle
    must not be given twice. Parts that share no edge may touch but not overlap. A part inside another one is a cavity
    and must be oriented inward. Triangles without area are allowed. Parts that overlap partly are not detected, and
    their common volume is then counted wrongly.

    ValueError for NaN, infinity, a magnitude above 1e50, wrong shapes, types or indices, an open surface, or a part of
    the wrong orientation. Its text names the argument and the first wrong triangle or edge.
    """

    def __init__(self, vertices: Array, triangles: Array) -> None:
        places = checked_vertices(vertices)
        given = checked_triangles(triangles, len(places))
        kept, numbers_given = merged(places, given)
        if len(kept) == 0:
            raise ValueError("each of triangles has a corner twice; valid: a closed surface with a volume above 0")
        require_closed(kept, numbers_given)
        require_all_different(kept, numbers_given)
        corners = places[kept]
        require_outward(corners, components(kept), numbers_given)
        self.volume_m3 = signed_volume(corners)
        """Enclosed volume (m³)"""
        if self.volume_m3 <= 0.0:
            raise ValueError(f"triangles enclose {self.volume_m3:.3g} m³; valid: a volume above 0")
        self.triangle_count = len(kept)
        self.lowest_m: FloatArray = corners.reshape(-1, 3).min(axis=0)
        """Lowest coordinate (m) on each axis (3,)"""
        self.highest_m: FloatArray = corners.reshape(-1, 3).max(axis=0)
        """Highest coordinate (m) on each axis (3,)"""
        self.tables = mesh_tables(corners, self.volume_m3)

    @overload
    def overlap(self, centers: Array, radii: Array, *, gradient: Literal[False] = False) -> FloatArray: ...
    @overload
    def overlap(self, centers: Array, radii: Array, *, gradient: Literal[True]) -> Overlaps: ...
    def overlap(self, centers: Array, radii: Array, *, gradient: bool = False) -> FloatArray | Overlaps:
        """Return the overlap with the spheres `centers` (..., 3), `radii` (...) in m; results are as in `volumes`."""
        (volumes, gradients, areas), _ = self._query(centers, radii)
        return (volumes, gradients, areas) if gradient else volumes

    def counts(self, centers: Array, radii: Array) -> IntArray:
        """Return how many triangles (...) the overlap with each sphere has to evaluate: the query's cost."""
        return self._query(centers, radii)[1]

    def _query(self, centers: Array, radii: Array) -> tuple[Overlaps, IntArray]:
        # A robot side makes meshes and never asks them, and so compiles no kernel for it.
        from robot_side.overlap.meshes.mesh_pairs import overlap_loop  # noqa: PLC0415

        arguments = numbers("centers", centers, (3,)), lengths("radii", radii)
        shape = broadcast(arguments)
        rows = [argument.rows(shape) for argument in arguments]
        count = len(rows[1])
        volumes, gradients, areas = np.empty(count), np.empty((count, 3)), np.empty(count)
        touched = np.empty(count, dtype=np.int64)
        everywhere = np.zeros(count, dtype=np.int64)
        overlap_loop(*rows, everywhere, *_IN_PLACE, self.tables, volumes, gradients, areas, touched, self.tables.room())
        results = volumes.reshape(shape), gradients.reshape(*shape, 3), areas.reshape(shape)
        return results, touched.reshape(shape)


@overload
def sphere_mesh(
    centers: Array, radii: Array, vertices: Array, triangles: Array, *, gradient: Literal[False] = False
) -> FloatArray: ...
@overload
def sphere_mesh(
    centers: Array, radii: Array, vertices: Array, triangles: Array, *, gradient: Literal[True]
) -> Overlaps: ...
def sphere_mesh(
    centers: Array, radii: Array, vertices: Array, triangles: Array, *, gradient: bool = False
) -> FloatArray | Overlaps:
    """Return the overlap of the spheres `centers` (..., 3), `radii` (...) with one mesh.

    `Mesh` describes `vertices` and `triangles`, `volumes` the results. The last eight meshes are cached, so that they
    are not prepared again. With a `Mesh` object even the look-up is saved.
    """
    places = np.ascontiguousarray(checked_vertices(vertices))
    indices = checked_triangles(triangles, len(places))
    mesh = _remembered(places.tobytes(), indices.tobytes())
    if gradient:
        return mesh.overlap(centers, radii, gradient=True)
    return mesh.overlap(centers, radii)


@functools.lru_cache(maxsize=8)
def _remembered(vertices: bytes, triangles: bytes) -> Mesh:
    return Mesh(np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(triangles, dtype=np.int64).reshape(-1, 3))
