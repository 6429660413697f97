"""Cover of a closed solid, or of several overlapping solids: few spheres that contain the surface and hardly protrude.

Every sphere's centre is inside, and its radius is the centre's depth plus the distance by which spheres may protrude.
Candidate centres lie in several depths below points of the surface. A set cover chooses enough of them to contain these
points. Then the whole surface is checked, down to small cells: a sphere that contains a cell's corners contains the
cell, within the margin of the radii. Corners that no sphere contains are added to the points.
"""

from collections.abc import Sequence

import numpy as np

from common.arrays import BoolArray, FloatArray
from robot_side.gripper.choosing import containing, greedy_set_cover, with_contained
from robot_side.gripper.mirrors import mirror_images
from robot_side.gripper.search_work import CHOICE, SPHERE_TEST, SearchWork
from robot_side.gripper.solid_union import Cells, SolidUnion
from robot_side.gripper.solids import Solid, halved

_MOST_POINTS = 1500
_MOST_STARTS = 600
_MOST_CENTERS = 2500
_MOST_ROUNDS = 40
_CHOSEN_ANEW = 5
_GIVES_WAY_M = 0.003
"""Distance up to which spheres may protrude farther than asked, in m, if the work would be too much"""
_CELL = 0.03
"""Longest edge of the smallest cells, as a share of the distance by which spheres may protrude"""
_CHOSEN_WITH = 0.97
"""Share of that distance used in choosing spheres for points; the rest lets them contain most of the surface between"""
_DEPTHS = np.array([0.15, 0.35, 0.6, 1.0, 1.5, 2.2, 3.0, 4.0, 5.5, 7.5, 10.0, 14.0, 20.0, 30.0])
"""Depths of candidate centres, as multiples of the distance by which spheres may protrude"""
_COARSER = 1.2

Spheres = tuple[FloatArray, FloatArray]
"""Centres (m, 3) and radii (m,)."""


def cover_surface(
    solids: Sequence[Solid],
    stand_out_m: float,
    frames: Sequence[FloatArray] = (),
    most: int = 2000,
    work: SearchWork | None = None,
) -> tuple[FloatArray, FloatArray, float]:
    """Return spheres' centres (m, 3), radii (m,), and the distance by which they protrude from the union of `solids`.

    The distance is `stand_out_m`, or as much more as is needed for at most `most` spheres. If `work` is spent before,
    it is at least 3 mm. The spheres share the union's mirror planes normal to axes of `frames` (3, 3) or to its
    principal axes. The result depends on nothing else.
    """
    work = work or SearchWork()
    union = SolidUnion(solids, work)
    # Skip hopeless searches: discs of radius √30 s, those of centres 14.5 s deep, cannot cover the area.
    while union.area_m2 > most * 30.0 * stand_out_m**2 * np.pi:
        stand_out_m *= _COARSER
    while True:
        spheres = _cover(union, stand_out_m, frames, most, work)
        if spheres is not None:
            return *spheres, stand_out_m
        stand_out_m = max(_COARSER * stand_out_m, _GIVES_WAY_M if work.spent else 0.0)


def _cover(
    union: SolidUnion, stand_out_m: float, frames: Sequence[FloatArray], most: int, work: SearchWork
) -> Spheres | None:
    """Return spheres that cover the union; None if more than `most` are needed, or too much work for so fine ones."""
    cell_m = _CELL * stand_out_m
    # Every point of a cell is nearer than this to one of the corners.
    margin_m = cell_m / np.sqrt(3.0)
    coarse, _ = union.points(float(np.sqrt(union.area_m2 / 200.0)), margin_m)
    origin, images = mirror_images(coarse, union.depth_m, frames)
    step_m = max(0.6 * stand_out_m, float(np.sqrt(1.5 * union.area_m2 / len(images) / _MOST_POINTS)))
    cells = every_cell = union.cells(step_m, cell_m)
    # One of the mirror images of each point is enough.
    points, normals = _first_images(*union.points(step_m, margin_m), origin, images)
    centers, depths = _alike(union, _below(union, points, normals, stand_out_m, images, origin), origin, images)
    lean_m = _CHOSEN_WITH * stand_out_m - margin_m
    before: Spheres = np.empty((0, 3)), np.empty(0)
    inside = None
    for turn in range(_MOST_ROUNDS):
        if work.spent and stand_out_m < _GIVES_WAY_M:
            return None
        known = 0 if inside is None else inside.shape[0] * inside.shape[1]
        work.add(SPHERE_TEST * (len(centers) * len(points) - known) * len(images))
        inside = with_contained(inside, centers - origin, depths + lean_m, points - origin, images)
        rows = greedy_set_cover(inside, _orbit_sizes(centers - origin, images))
        work.add(CHOICE * inside.nnz * len(rows))
        added = _all_images(centers[rows], depths[rows] + stand_out_m, origin, images)
        spheres = np.concatenate([before[0], added[0]]), np.concatenate([before[1], added[1]])
        if len(spheres[1]) > most:
            return None
        left, missed = _not_contained(union, cells, spheres[0], spheres[1] - margin_m, cell_m, work)
        if not len(missed):
            return spheres
        work.covered = 1.0 - sum(len(of.bare) for of in left) / sum(len(of.bare) for of in every_cell)
        missed, _ = _first_images(missed, missed, origin, images)
        if turn < _CHOSEN_ANEW and not work.spent:
            # Chosen together with the others, such a point hardly costs another sphere.
            points = np.concatenate([points, missed])
        else:
            before, points, cells, inside = spheres, missed, left, None
        more = _alike(union, _between(missed, centers, depths), origin, images)
        centers, depths = np.concatenate([centers, more[0]]), np.concatenate([depths, more[1]])
    return None


def _below(
    union: SolidUnion,
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


def _alike(union: SolidUnion, centers_m: FloatArray, origin_m: FloatArray, images: FloatArray) -> Spheres:
    """Return the centres (c, 3) whose images are all inside, and the depth (c,) of each centre's shallowest image.

    With that depth, no image protrudes by more than another.
    """
    depths = np.array([union.room_m((centers_m - origin_m) @ image.T + origin_m) for image in images]).min(axis=0)
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
    union: SolidUnion,
    cells: Sequence[Cells],
    centers_m: FloatArray,
    radii_m: FloatArray,
    smallest_m: float,
    work: SearchWork,
) -> tuple[list[Cells], FloatArray]:
    """Return the cells that no single sphere contains, even when subdivided, and their corners outside all spheres."""
    left, points = [], [np.empty((0, 3))]
    for number, of_solid in enumerate(cells):
        waiting, still = of_solid, []
        while len(waiting.corners_m):
            work.add(2 * SPHERE_TEST * waiting.bare.size * len(radii_m))
            waiting = waiting.only(~_within_one(waiting.corners_m, centers_m, radii_m))
            missed = waiting.bare & ~_within_any(waiting.corners_m.reshape(-1, 3), centers_m, radii_m).reshape(-1, 3)
            found = missed.any(axis=1)
            points.append(waiting.corners_m[missed])
            still.append(waiting.only(found))
            whole = waiting.corners_m[~found]
            longest = np.linalg.norm(whole - np.roll(whole, -1, axis=1), axis=2).max(axis=1, initial=0.0)
            waiting = union.outer_cells(number, halved(whole[longest > smallest_m]), smallest_m)
        left.append(Cells(*(np.concatenate(column) for column in zip(*still, strict=True))) if still else of_solid)
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
