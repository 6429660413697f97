"""Closed shapes to be covered by spheres: triangles of the surface, and the depth of points inside."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from common.arrays import FloatArray
from robot_side.overlap.meshes.mesh_shapes import capsule_mesh, ellipsoid_mesh

_POINTS_AT_A_TIME = 128
# Excess of the prism around a cylinder, as a share of the radius.
_EXCESS = 0.003
_SUBDIVISIONS = 16
_FEW_FACES = 400

_Depth = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Solid:
    """Closed solid, or a polyhedron that contains it."""

    corners_m: FloatArray
    """(t, 3, 3) triangles of the surface; corners anticlockwise as seen from outside"""
    depth_m: _Depth
    """Function from points (n, 3) to lower bounds (n,) of their depth below the surface; negative outside"""
    excess_m: float = 0.0
    """Largest distance by which the polyhedron protrudes from the true solid"""
    true_depth_m: _Depth | None = None
    """Function from points (n, 3) to depths (n,) below the true solid's surface. Given: `excess_m` is unused"""

    def placed(self, rotation: FloatArray, position_m: FloatArray) -> "Solid":
        """Return the solid moved to the pose `rotation` (3, 3), `position_m` (3,)."""

        def at_pose(depth_m: _Depth) -> _Depth:
            return lambda points: depth_m((points - position_m) @ rotation)

        return Solid(
            self.corners_m @ rotation.T + position_m,
            at_pose(self.depth_m),
            self.excess_m,
            None if self.true_depth_m is None else at_pose(self.true_depth_m),
        )


def convex_solid(points_m: FloatArray, excess_m: float = 0.0) -> Solid | None:
    """Return the convex hull of `points_m` (n, 3), which protrudes from the true solid by at most `excess_m`.

    None for coplanar points, which enclose nothing.
    """
    try:
        hull = ConvexHull(points_m)
    except (QhullError, ValueError):
        return None
    normals, offsets = np.unique(hull.equations.round(12), axis=0)[:, :3], np.empty(0)
    offsets = (hull.points[hull.vertices] @ normals.T).max(axis=0)
    corners = hull.points[hull.simplices]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.sum(across * hull.equations[:, :3], axis=1) < 0.0
    corners[inward] = corners[inward][:, ::-1]

    def depth_m(points: FloatArray) -> FloatArray:
        # A point's depth in a convex polyhedron is the distance to the nearest face's plane.
        pieces = range(0, len(points), _POINTS_AT_A_TIME)
        nearest = [(offsets - points[first : first + _POINTS_AT_A_TIME] @ normals.T).min(axis=1) for first in pieces]
        return np.concatenate([np.empty(0), *nearest])

    return Solid(corners, depth_m, excess_m)


def simpler_convex_solid(points_m: FloatArray, tolerance_m: float) -> Solid | None:
    """Return a convex polyhedron with fewer faces around the hull of `points_m` (n, 3); None for coplanar points.

    Each face is moved outwards by at most `tolerance_m`. A search takes minutes for a drawn part's thousands of faces.
    """
    whole = convex_solid(points_m)
    if whole is None or len(whole.corners_m) <= _FEW_FACES:
        return whole
    around = np.unique(whole.corners_m.reshape(-1, 3), axis=0)
    directions = np.array([one for one in np.ndindex(3, 3, 3) if one != (1, 1, 1)], dtype=np.float64) - 1.0
    chosen = np.unique((around @ directions.T).argmax(axis=0))
    while True:
        hull = ConvexHull(around[chosen])
        normals = hull.equations[:, :3]
        beyond_m = around @ normals.T + hull.equations[:, 3]
        farthest, missed_m = beyond_m.argmax(axis=0), beyond_m.max(axis=0)
        if missed_m.max() <= tolerance_m:
            break
        chosen = np.union1d(chosen, farthest[missed_m > tolerance_m])
    planes = np.column_stack([normals, hull.equations[:, 3] - np.maximum(missed_m, 0.0)])
    try:
        corners = HalfspaceIntersection(np.unique(planes.round(12), axis=0), around[chosen].mean(axis=0)).intersections
    except QhullError:
        return whole
    simpler = convex_solid(corners)
    if simpler is None or len(simpler.corners_m) >= len(whole.corners_m):
        return whole
    return Solid(simpler.corners_m, simpler.depth_m, true_depth_m=whole.depth_m)


def cylinder(radius_m: float, half_length_m: float) -> Solid | None:
    """Return a prism that contains a cylinder about the z axis; None without volume."""
    sides = math.ceil(math.pi / math.acos(1.0 / (1.0 + _EXCESS)))
    # A multiple of four has the cylinder's mirror planes.
    sides += -sides % 4
    turns = 2.0 * math.pi * (np.arange(sides) + 0.5) / sides
    reach_m = radius_m / math.cos(math.pi / sides)
    ring = reach_m * np.column_stack([np.cos(turns), np.sin(turns)])
    ends = [np.column_stack([ring, np.full(sides, z)]) for z in (-half_length_m, half_length_m)]
    return convex_solid(np.concatenate(ends), reach_m - radius_m)


def ellipsoid(semi_axes_m: FloatArray) -> Solid | None:
    """Return a polyhedron that contains an ellipsoid with semi-axes (3,) along x, y and z; None without volume."""
    around = ellipsoid_mesh(semi_axes_m, _SUBDIVISIONS)
    return convex_solid(around.vertices, around.stands_out_m)


def capsule(radius_m: float, half_length_m: float) -> Solid | None:
    """Return a polyhedron that contains a capsule along the z axis; None without volume."""
    around = capsule_mesh(radius_m, half_length_m, _SUBDIVISIONS)
    return convex_solid(around.vertices, around.stands_out_m)


def triangles_within(corners_m: FloatArray, longest_m: float) -> FloatArray:
    """Return the triangles `corners_m` (t, 3, 3) subdivided into (k, 3, 3), with edges of at most `longest_m`."""
    done = []
    while len(corners_m):
        lengths = np.linalg.norm(corners_m - np.roll(corners_m, -1, axis=1), axis=2)
        long = lengths.max(axis=1) > longest_m
        done.append(corners_m[~long])
        corners_m = halved(corners_m[long])
    return np.concatenate([np.empty((0, 3, 3)), *done])


def halved(corners_m: FloatArray) -> FloatArray:
    """Return the triangles (2 t, 3, 3) that result when each triangle (t, 3, 3) is halved at its longest edge."""
    lengths = np.linalg.norm(corners_m - np.roll(corners_m, -1, axis=1), axis=2)
    rows, first = np.arange(len(corners_m)), lengths.argmax(axis=1)
    a, b, c = (corners_m[rows, (first + turn) % 3] for turn in range(3))
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def corner_points(corners_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return each corner of the triangles (t, 3, 3) once (p, 3), and the mean normal (p, 3) of the faces there."""
    across = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    units = np.divide(across, lengths, out=np.zeros_like(across), where=lengths > 0.0)
    points = corners_m.reshape(-1, 3)
    _, first, place = np.unique(
        (points / 1e-7).round().astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    place = place.ravel()
    # Each face at a sharp edge counts once, for any subdivision.
    faces = np.column_stack([place, np.repeat((units * 1e3).round().astype(np.int64), 3, axis=0)])
    different = np.unique(faces, axis=0, return_index=True)[1]
    normals = np.zeros((len(first), 3))
    np.add.at(normals, place[different], np.repeat(units, 3, axis=0)[different])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return points[first], np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 1e-9)
