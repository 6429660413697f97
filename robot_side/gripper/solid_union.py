"""Union of solids that are covered together: its surface as points and as cells, and depths of points below it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray
from robot_side.gripper.search_work import FACE_TEST, SearchWork
from robot_side.gripper.solids import Solid, corner_points, triangles_within

_ROUNDING_M = 1e-9


class Cells(NamedTuple):
    """Triangles of one solid's surface that are not all within other solids."""

    corners_m: FloatArray
    """(t, 3, 3)"""
    bare: BoolArray
    """(t, 3) Whether each corner is on the union's surface"""

    def only(self, rows: BoolArray | np.bool) -> "Cells":
        """Return the cells of these rows (t,)."""
        return Cells(self.corners_m[rows], self.bare[rows])


class SolidUnion:
    """Union of solids; a part of one solid's surface inside another solid is no surface of the union."""

    def __init__(self, solids: Sequence[Solid], work: SearchWork) -> None:
        self._solids, self._work = solids, work
        self.area_m2 = float(sum(_area_m2(solid.corners_m) for solid in solids))

    def depth_m(self, points_m: FloatArray) -> FloatArray:
        """Return (n,): the greatest depth of each point (n, 3) in any of the solids."""
        depths: FloatArray = np.array([self._depth_m(solid, points_m) for solid in self._solids]).max(axis=0)
        return depths

    def _depth_m(self, solid: Solid, points_m: FloatArray) -> FloatArray:
        self._work.add(FACE_TEST * len(points_m) * len(solid.corners_m))
        return solid.depth_m(points_m)

    def room_m(self, points_m: FloatArray) -> FloatArray:
        """Return (n,): a lower bound of each point's depth (n, 3) in a true solid; -infinity outside."""
        deepest: FloatArray = np.full(len(points_m), -np.inf)
        for solid in self._solids:
            depths = self._depth_m(solid, points_m)
            inside = depths >= -_ROUNDING_M
            # A true shape may have thousands of faces, and is within the polyhedron.
            room = (
                depths[inside] - solid.excess_m if solid.true_depth_m is None else solid.true_depth_m(points_m[inside])
            )
            deepest[inside] = np.maximum(
                deepest[inside], np.where(room >= -_ROUNDING_M - solid.excess_m, room, -np.inf)
            )
        return deepest

    def cells(self, longest_m: float, margin_m: float) -> list[Cells]:
        """Return for each solid the cells of its surface, subdivided to edges of at most `longest_m`."""
        triangles = [triangles_within(solid.corners_m, longest_m) for solid in self._solids]
        return [self.outer_cells(number, corners, margin_m) for number, corners in enumerate(triangles)]

    def outer_cells(self, solid: int, triangles_m: FloatArray, margin_m: float) -> Cells:
        """Return those of a solid's triangles (t, 3, 3) that have a corner on the union's surface."""
        corners, place = np.unique(triangles_m.reshape(-1, 3), axis=0, return_inverse=True)
        bare = self.outside(solid, corners, margin_m)[place.ravel()].reshape(-1, 3)
        kept = bare.any(axis=1)
        return Cells(triangles_m[kept], bare[kept])

    def points(self, longest_m: float, margin_m: float) -> tuple[FloatArray, FloatArray]:
        """Return points (p, 3) and normals (p, 3) of the union's surface; neighbours are at most `longest_m` apart."""
        found = []
        for number, solid in enumerate(self._solids):
            corners = triangles_within(solid.corners_m, longest_m)
            points, normals = corner_points(corners)
            outside = self.outside(number, points, margin_m)
            found.append(np.concatenate([points[outside], normals[outside]], axis=1))
        both = np.concatenate(found)
        return both[:, :3], both[:, 3:]

    def outside(self, solid: int, points_m: FloatArray, margin_m: float) -> BoolArray:
        """Return (n,): whether no other solid contains a point (n, 3) of this solid's surface by `margin_m` or more."""
        outside = np.ones(len(points_m), dtype=np.bool_)
        for number, other in enumerate(self._solids):
            if number != solid:
                outside[outside] = self._depth_m(other, points_m[outside]) < margin_m
        return outside


def _area_m2(corners_m: FloatArray) -> float:
    across = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    return float(0.5 * np.linalg.norm(across, axis=1).sum())
