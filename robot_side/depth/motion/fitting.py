"""How far a region has moved since an earlier picture: point to plane, as far as the surfaces' normals show it."""

import math
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import FLOAT64, INT64, compiled, input_array, output_array
from robot_side.compiled.vectors import dot, subtract
from robot_side.depth.motion.regions import AROUND, LABELS, STILL_M, LabelsArray, Regions
from robot_side.depth.motion.snapshots import FREE, SURFACE, Snapshot, surface_at
from robot_side.depth.picture import DepthArray, LabelArray
from robot_side.depth.view import DIRECTIONS, MASK, PICTURE, ray_at, sd_at, to_world, turned_to_world

_CAPS_M: Final = (0.05, 0.03, 0.015, 0.0, 0.0)
"""Distances from the plane, beyond the errors, up to which a point counts, fit by fit"""
_SIGMAS: Final = 3.0
_LEAST_M: Final = 0.001
_ALIKE: Final = 0.5
_SEEN: Final = 0.06
"""Share of the largest eigenvalue below which motion along an eigenvector does not show: sliding along a plane"""
_SIGNIFICANT: Final = 5.0
"""Standard deviations from which on motion counts"""
_AGREEING: Final = 0.6
"""Share of a region's points that must agree with its motion"""
_FEWEST: Final = 8
_STEPS_M: Final = tuple(0.005 * step for step in range(14))
"""Distances by which a region may have slid along itself"""
_LEAST_PIXELS: Final = 2.5
"""Pixels by which it has at least, to count"""
_MOST_OF: Final = 0.9
"""Share of the points that appeared which must have come from somewhere"""
_CLOSE: Final = 5
"""Pixels around those that are elsewhere by themselves that belong to what moves"""


class Fit(NamedTuple):
    """Motion of a region."""

    moved_m: FloatArray
    """(3,) displacement since the earlier picture, in the world; 0 where the surfaces' normals do not show it"""
    center_m: FloatArray
    """(3,) mean of its points now"""
    reach_m: float
    """Root of the mean square distance from there"""
    points: float
    """Number of points that agree"""
    slid: bool
    """Whether it is a least distance, by where nothing was before"""


def fit_motion(
    newest: Snapshot,
    before: Snapshot,
    regions: Regions,
    region: int,
    slack: tuple[float, float],
    pixels_alike: float,
    start_m: FloatArray,
) -> Fit | None:
    """Return how a region has moved; None if it has not significantly, or not as one.

    pixels_alike: number of pixels whose errors are one. start_m (3,): displacement that is expected.
    """
    sums = np.empty(16)

    def solve(cap_m: float, from_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the displacement by the points near `from_m` (3,), and eigenvalues and vectors of their matrix."""
        _sum(*newest.arrays, *before.arrays, *slack, cap_m, from_m, regions.labels, region, sums)
        a, b, c, d, e, f = sums[:6] / pixels_alike
        values, vectors = np.linalg.eigh(np.array([[a, d, e], [d, b, f], [e, f, c]]))
        shown = values > max(_SEEN * values[-1], 1e-9)
        along = vectors[:, shown]
        by_m = along @ (along.T @ sums[6:9] / pixels_alike / values[shown])
        return from_m + by_m, np.where(shown, values, 0.0), vectors

    moved_m = np.ascontiguousarray(start_m, dtype=float)
    for cap_m in _CAPS_M:
        moved_m, values, vectors = solve(cap_m, moved_m)
        moved_m = vectors[:, values > 0.0] @ (vectors[:, values > 0.0].T @ moved_m)
    if sums[9] < _FEWEST:
        return None
    far_from_m = float(np.linalg.norm(sums[11:14] / sums[9] - newest.pose.position_m))
    least_m = _LEAST_PIXELS * far_from_m / float(newest.view[0])
    fitted, entered = moved_m, False
    for way in (sign * vectors[:, k] for k in np.flatnonzero(values == 0.0) for sign in (-1.0, 1.0)):
        # Points where nothing was must have come from somewhere: from no further than the nearest place on the region.
        tried = []
        for step_m in _STEPS_M:
            slid_m, _, _ = solve(0.0, moved_m + step_m * way)
            tried.append((step_m, sums[9] - _AGREEING * sums[10], slid_m))
        gain = max(one[1] for one in tried) - tried[0][1]
        step_m, _, slid_m = next(one for one in tried if one[1] >= tried[0][1] + _MOST_OF * gain)
        if gain >= _FEWEST and step_m >= least_m and step_m > float(np.linalg.norm(fitted - moved_m)):
            fitted, entered = slid_m, True
    moved_m = fitted
    solve(0.0, moved_m)
    if sums[9] < _FEWEST:
        return None
    center_m = sums[11:14] / sums[9]
    information = float(values @ (vectors.T @ moved_m) ** 2)
    seeming_m = slack[0] + slack[1] * far_from_m
    agrees = sums[9] >= _AGREEING * sums[10]
    significant = entered or information >= _SIGNIFICANT**2
    if not agrees or not significant or float(np.linalg.norm(moved_m)) <= seeming_m + _LEAST_M:
        return None
    reach_m = math.sqrt(max(sums[14] / sums[9] - float(center_m @ center_m), 0.0))
    return Fit(moved_m, center_m, reach_m, float(sums[9]), entered)


def note_members(
    newest: Snapshot,
    before: Snapshot,
    regions: Regions,
    region: int,
    slack: tuple[float, float],
    moved_m: FloatArray,
    identity: int,
    members: LabelsArray,
) -> None:
    """Write `identity` into the pixels of `members` (h, w) that have moved with their region."""
    _note(
        *(newest.depth_m, newest.view, *before.arrays, *slack, np.ascontiguousarray(moved_m)),
        *(regions.labels, regions.spreads, region, identity, members),
    )


_BEFORE: Final = PICTURE, DIRECTIONS, MASK, input_array(1)


@compiled(*_BEFORE, *_BEFORE, FLOAT64, FLOAT64, FLOAT64, input_array(1), LABELS, INT64, output_array(1))
def _sum(
    depth_m: DepthArray,
    normals: DepthArray,
    own: LabelArray,
    view: FloatArray,
    depth_before_m: DepthArray,
    normals_before: DepthArray,
    own_before: LabelArray,
    view_before: FloatArray,
    slack_m: float,
    slack: float,
    cap_m: float,
    moved_m: FloatArray,
    labels: LabelsArray,
    region: int,
    sums: FloatArray,
) -> None:
    """Sum the equations of a region's points.

    sums: matrix xx, yy, zz, xy, xz, yz; right side (3); points that agree, and all that could; sum of the points (3),
    and of their squares.
    """
    for k in range(sums.size):
        sums[k] = 0.0
    by = moved_m[0], moved_m[1], moved_m[2]
    for i in range(depth_m.shape[0]):
        for j in range(depth_m.shape[1]):
            if labels[i, j] != region or own[i, j]:
                continue
            z, facing = 1.0 * depth_m[i, j], (1.0 * normals[i, j, 0], 1.0 * normals[i, j, 1], 1.0 * normals[i, j, 2])
            if dot(facing, facing) == 0.0:
                continue
            x, y = ray_at(view, i, j)
            point = to_world(view, (x * z, y * z, z))
            known, away, variance, normal = surface_at(
                subtract(point, by), depth_before_m, normals_before, own_before, view_before
            )
            sums[10] += known == SURFACE or (known == FREE and slack_m <= STILL_M)
            if known != SURFACE:
                continue
            variance += (sd_at(view, z) * dot(facing, (x, y, 1.0))) ** 2 + _LEAST_M**2
            near = abs(away) <= cap_m + _SIGMAS * math.sqrt(variance) + slack_m + slack * z
            if not near or dot(turned_to_world(view, facing), normal) < _ALIKE:
                continue
            weight = 1.0 / variance
            for k in range(3):
                sums[k] += weight * normal[k] * normal[k]
                sums[6 + k] += weight * normal[k] * away
                sums[11 + k] += point[k]
            sums[3] += weight * normal[0] * normal[1]
            sums[4] += weight * normal[0] * normal[2]
            sums[5] += weight * normal[1] * normal[2]
            sums[9] += 1.0
            sums[14] += dot(point, point)


@compiled(
    *(PICTURE, input_array(1), *_BEFORE, FLOAT64, FLOAT64, input_array(1)),
    *(LABELS, LABELS, INT64, INT64, LABELS),
)
def _note(
    depth_m: DepthArray,
    view: FloatArray,
    depth_before_m: DepthArray,
    normals_before: DepthArray,
    own_before: LabelArray,
    view_before: FloatArray,
    slack_m: float,
    slack: float,
    moved_m: FloatArray,
    labels: LabelsArray,
    spreads: LabelsArray,
    region: int,
    identity: int,
    members: LabelsArray,
) -> None:
    by = moved_m[0], moved_m[1], moved_m[2]
    for i in range(depth_m.shape[0]):
        for j in range(depth_m.shape[1]):
            if labels[i, j] != region or spreads[i, j] < AROUND - _CLOSE:
                continue
            z = 1.0 * depth_m[i, j]
            x, y = ray_at(view, i, j)
            point = subtract(to_world(view, (x * z, y * z, z)), by)
            known, away, variance, _ = surface_at(point, depth_before_m, normals_before, own_before, view_before)
            variance += sd_at(view, z) ** 2
            far = _SIGMAS * math.sqrt(variance) + slack_m + slack * z + _LEAST_M
            # What has come to where nothing was moves, although its motion may be underestimated.
            if known != SURFACE or abs(away) <= far or (away > 0.0 and spreads[i, j] == AROUND):
                members[i, j] = identity
