"""Cover of a closed solid, or of several overlapping solids: few spheres that contain the surface and hardly protrude.

Every sphere's centre is inside, and its radius is the centre's depth plus the distance by which spheres may protrude.
Candidate centres lie in several depths below points of the surface. A set cover chooses enough of them to contain these
points. Then the whole surface is checked, down to small cells: a sphere that contains a cell's corners contains the
cell, within the margin of the radii. Corners that no sphere contains are added to the points.
"""

from collections.abc import Sequence

import numpy as np

from common.arrays import BoolArray, FloatArray
from robot_side.gripper.choosing import contained_points, containing, greedy_set_cover
from robot_side.gripper.mirrors import mirror_images
from robot_side.gripper.solids import Solid, corner_points, halved, triangles_within

_MOST_POINTS = 1500
_MOST_STARTS = 600
_MOST_CENTERS = 2500
_MOST_ROUNDS = 40
_CHOSEN_ANEW = 5
_MOST_TESTS = 1_000_000_000
"""Tests of a point in a sphere, some seconds, after which spheres are only added and not chosen anew."""
_CELL = 0.03
"""Longest edge of the smallest cells, as a share of the distance by which spheres may protrude"""
_CHOSEN_WITH = 0.97
"""Share of that distance used in choosing spheres for points; the rest lets them contain most of the surface between"""
_DEPTHS = np.array([0.15, 0.35, 0.6, 1.0, 1.5, 2.2, 3.0, 4.0, 5.5, 7.5, 10.0, 14.0, 20.0, 30.0])
"""Depths of candidate centres, as multiples of the distance by which spheres may protrude"""
_COARSER = 1.2
_ROUNDING_M = 1e-9

Spheres = tuple[FloatArray, FloatArray]
"""Centres (m, 3) and radii (m,)."""


class _Union:
    """Union of solids; a part of one solid's surface inside another solid is no surface of the union."""

    def __init__(self, solids: Sequence[Solid]) -> None:
        self._solids = solids
        self.area_m2 = float(sum(_area_m2(solid.corners_m) for solid in solids))

    def depth_m(self, points_m: FloatArray) -> FloatArray:
        """Return (n,): the greatest depth of each point (n, 3) in any of the solids."""
        depths: FloatArray = np.max([solid.depth_m(points_m) for solid in self._solids], axis=0)
        return depths

    def room_m(self, points_m: FloatArray) -> FloatArray:
        """Return (n,): a lower bound of each point's depth (n, 3) in a true solid; -infinity outside."""
        rooms = []
        for solid in self._solids:
            excess_m = solid.excess_m if solid.true_depth_m is None else 0.0
            depths = (solid.true_depth_m or solid.depth_m)(points_m)
            rooms.append(np.where(depths >= -_ROUNDING_M, depths - excess_m, -np.inf))
        deepest: FloatArray = np.max(rooms, axis=0)
        return deepest

    def cells(self, longest_m: float) -> list[FloatArray]:
        """Return for each solid the triangles (t, 3, 3) of its surface, subdivided to edges of at most `longest_m`."""
        return [triangles_within(solid.corners_m, longest_m) for solid in self._solids]

    def points(self, longest_m: float, margin_m: float) -> tuple[FloatArray, FloatArray]:
        """Return points (p, 3) and normals (p, 3) of the union's surface; neighbours are at most `longest_m` apart."""
        found = []
        for number, corners in enumerate(self.cells(longest_m)):
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
                outside[outside] = other.depth_m(points_m[outside]) < margin_m
        return outside


def cover_surface(
    solids: Sequence[Solid], stand_out_m: float, frames: Sequence[FloatArray] = (), most: int = 2000
) -> tuple[FloatArray, FloatArray, float]:
    """Return spheres' centres (m, 3), radii (m,), and the distance by which they protrude from the union of `solids`.

    The distance is `stand_out_m`, or as much more as is needed for at most `most` spheres. The spheres share the
    union's mirror planes normal to axes of `frames` (3, 3) or to its principal axes. The result depends on nothing
    else.
    """
    union = _Union(solids)
    # Skip hopeless searches: discs of radius √30 s, those of centres 14.5 s deep, cannot cover the area.
    while union.area_m2 > most * 30.0 * stand_out_m**2 * np.pi:
        stand_out_m *= _COARSER
    while True:
        spheres = _cover(union, stand_out_m, frames, most)
        if spheres is not None:
            return *spheres, stand_out_m
        stand_out_m *= _COARSER


def _cover(union: _Union, stand_out_m: float, frames: Sequence[FloatArray], most: int) -> Spheres | None:
    """Return spheres that cover the union; None if more than `most` are needed."""
    cell_m = _CELL * stand_out_m
    # Every point of a cell is nearer than this to one of the corners.
    margin_m = cell_m / np.sqrt(3.0)
    coarse, _ = union.points(float(np.sqrt(union.area_m2 / 200.0)), margin_m)
    origin, images = mirror_images(coarse, union.depth_m, frames)
    step_m = max(0.6 * stand_out_m, float(np.sqrt(1.5 * union.area_m2 / len(images) / _MOST_POINTS)))
    cells = union.cells(step_m)
    # One of the mirror images of each point is enough.
    points, normals = _first_images(*union.points(step_m, margin_m), origin, images)
    centers, depths = _alike(union, _below(union, points, normals, stand_out_m, images, origin), origin, images)
    lean_m = _CHOSEN_WITH * stand_out_m - margin_m
    before: Spheres = np.empty((0, 3)), np.empty(0)
    tests = 0
    for turn in range(_MOST_ROUNDS):
        tests += len(centers) * len(points) * len(images)
        inside = contained_points(centers - origin, depths + lean_m, points - origin, images)
        rows = greedy_set_cover(inside, _orbit_sizes(centers - origin, images))
        added = _all_images(centers[rows], depths[rows] + stand_out_m, origin, images)
        spheres = np.concatenate([before[0], added[0]]), np.concatenate([before[1], added[1]])
        if len(spheres[1]) > most:
            return None
        left, missed = _not_contained(union, cells, spheres[0], spheres[1] - margin_m, cell_m)
        if not len(missed):
            return spheres
        missed, _ = _first_images(missed, missed, origin, images)
        if turn < _CHOSEN_ANEW and tests < _MOST_TESTS:
            # Chosen together with the others, such a point hardly costs another sphere.
            points = np.concatenate([points, missed])
        else:
            before, points, cells = spheres, missed, left
        more = _alike(union, _between(missed, centers, depths), origin, images)
        centers, depths = np.concatenate([centers, more[0]]), np.concatenate([depths, more[1]])
    return None


def _below(
    union: _Union,
    points_m: FloatArray,
    normals: FloatArray,
    stand_out_m: float,
    images: FloatArray,
    origin_m: FloatArray,
) -> FloatArray:
    """Return candidate centres (c, 3) below points of the surface, down to the thickest place.

    The deepest centre below each point is also projected onto the mirror planes.
    """
    every = max(1, -(-len(points_m) // _MOST_STARTS))
    points_m, normals = points_m[::every], normals[::every]
    steps = np.concatenate([[0.0], _DEPTHS]) * stand_out_m
    centers = points_m[:, None] - steps[:, None] * normals[:, None]
    depths = union.depth_m(centers.reshape(-1, 3)).reshape(-1, len(steps))
    deepest = depths.argmax(axis=1)
    best, best_depth = steps[deepest], depths.max(axis=1)
    for share in (0.2, -0.2, 0.1, -0.1, 0.05, -0.05, 0.02, -0.02):
        tried = best * (1.0 + share)
        tried_depth = union.depth_m(points_m - tried[:, None] * normals)
        best = np.where(tried_depth > best_depth, tried, best)
        best_depth = np.maximum(tried_depth, best_depth)
    # Beyond the thickest place a centre belongs to the other side.
    sound = (depths >= 0.0) & (np.arange(len(steps)) < deepest[:, None])
    middles = points_m - best[:, None] * normals
    found = np.concatenate([middles, _onto_planes(middles - origin_m, images) + origin_m, centers[sound]])
    apart_m = 0.3 * stand_out_m
    while True:
        _, first = np.unique((found / apart_m).round().astype(np.int64), axis=0, return_index=True)
        if len(first) <= _MOST_CENTERS:
            return found[np.sort(first)]
        apart_m *= 1.2


def _between(points_m: FloatArray, centers_m: FloatArray, depths_m: FloatArray) -> FloatArray:
    """Return candidate centres (c, 3) between missed points (p, 3) and the centres of the spheres nearest to them."""
    # The points themselves are included, so that none is left in the end.
    found = [points_m]
    for point in points_m[:: max(1, -(-len(points_m) // 200))]:
        near = np.argsort(np.linalg.norm(centers_m - point, axis=1) - depths_m, kind="stable")[:4]
        found += [point + share * (centers_m[near] - point) for share in (0.05, 0.3, 0.6, 0.85)]
    return np.concatenate(found)


def _alike(union: _Union, centers_m: FloatArray, origin_m: FloatArray, images: FloatArray) -> Spheres:
    """Return the centres (c, 3) whose images are all inside, and the depth (c,) of each centre's shallowest image.

    With that depth, no image protrudes by more than another.
    """
    depths = np.min([union.room_m((centers_m - origin_m) @ image.T + origin_m) for image in images], axis=0)
    inside = np.isfinite(depths)
    return centers_m[inside], depths[inside]


def _onto_planes(points_m: FloatArray, images: FloatArray) -> FloatArray:
    """Return the points (n, 3) projected onto each mirror plane, and onto their intersections: (k, 3)."""
    return np.concatenate([np.empty((0, 3)), *(0.5 * (points_m + points_m @ image.T) for image in images[1:])])


def _first_images(points_m: FloatArray, normals: FloatArray, origin_m: FloatArray, images: FloatArray) -> Spheres:
    """Return points (n, 3) and normals (n, 3) mirrored to one side of each mirror plane, without duplicates."""
    points_m = points_m - origin_m
    for image in images[1:]:
        if np.isclose(np.trace(image), 1.0):
            across = np.linalg.eigh(image)[1][:, 0]
            behind = points_m @ across < 0.0
            points_m = np.where(behind[:, None], points_m @ image.T, points_m)
            normals = np.where(behind[:, None], normals @ image.T, normals)
    _, first = np.unique((points_m / 1e-7).round().astype(np.int64), axis=0, return_index=True)
    first.sort()
    return points_m[first] + origin_m, normals[first]


def _orbit_sizes(centers_m: FloatArray, images: FloatArray) -> FloatArray:
    """Return (n,): the number of different mirror images of each centre (n, 3), itself included."""
    still = [np.linalg.norm(centers_m @ image.T - centers_m, axis=1) < 1e-7 for image in images]
    sizes: FloatArray = len(images) / np.sum(still, axis=0)
    return sizes


def _all_images(centers_m: FloatArray, radii_m: FloatArray, origin_m: FloatArray, images: FloatArray) -> Spheres:
    moved = np.concatenate([(centers_m - origin_m) @ image.T + origin_m for image in images])
    _, first = np.unique((moved / 1e-7).round().astype(np.int64), axis=0, return_index=True)
    first.sort()
    return moved[first], np.tile(radii_m, len(images))[first]


def _not_contained(
    union: _Union, cells: Sequence[FloatArray], centers_m: FloatArray, radii_m: FloatArray, smallest_m: float
) -> tuple[list[FloatArray], FloatArray]:
    """Return the cells that no single sphere contains, even when subdivided, and their corners outside all spheres."""
    left, points = [], [np.empty((0, 3))]
    for number, of_solid in enumerate(cells):
        waiting, still = of_solid, [np.empty((0, 3, 3))]
        while len(waiting):
            waiting = waiting[~_within_one(waiting, centers_m, radii_m)]
            bare = union.outside(number, waiting.reshape(-1, 3), smallest_m).reshape(-1, 3)
            waiting, bare = waiting[bare.any(axis=1)], bare[bare.any(axis=1)]
            missed = bare & ~_within_any(waiting.reshape(-1, 3), centers_m, radii_m).reshape(-1, 3)
            found = missed.any(axis=1)
            points.append(waiting[missed])
            still.append(waiting[found])
            waiting = waiting[~found]
            longest = np.linalg.norm(waiting - np.roll(waiting, -1, axis=1), axis=2).max(axis=1, initial=0.0)
            waiting = halved(waiting[longest > smallest_m])
        left.append(np.concatenate(still))
    places = np.concatenate(points)
    _, first = np.unique((places / 1e-7).round().astype(np.int64), axis=0, return_index=True)
    return left, places[first]


def _within_one(cells: FloatArray, centers_m: FloatArray, radii_m: FloatArray) -> BoolArray:
    """Return (t,): whether one sphere contains all three corners of a triangle (t, 3, 3), and so the triangle."""
    pieces = []
    for first in range(0, len(cells), 2048):
        corners = cells[first : first + 2048]
        inside = containing(centers_m, radii_m, corners.reshape(-1, 3)).reshape(len(radii_m), -1, 3)
        pieces.append(inside.all(axis=2).any(axis=0))
    return np.concatenate([np.empty(0, dtype=np.bool_), *pieces])


def _within_any(points_m: FloatArray, centers_m: FloatArray, radii_m: FloatArray) -> BoolArray:
    pieces = [
        containing(centers_m, radii_m, points_m[first : first + 4096]).any(axis=0)
        for first in range(0, len(points_m), 4096)
    ]
    return np.concatenate([np.empty(0, dtype=np.bool_), *pieces])


def _area_m2(corners_m: FloatArray) -> float:
    across = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    return float(0.5 * np.linalg.norm(across, axis=1).sum())
