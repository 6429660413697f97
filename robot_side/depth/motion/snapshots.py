"""Coarser pictures, as motion is looked for in, and the earlier one that a newer one is compared with."""

import math
from collections import deque
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block
from robot_side.compiled.vectors import Vector, dot
from robot_side.depth.picture import CameraPose, DepthArray, DepthErrors, DepthPicture, LabelArray, Pinhole
from robot_side.depth.view import LEAST, MOST, pixel_of, ray_at, sd_at, to_camera, turned_to_world, view_of

_WIDTH: Final = 160
"""Pixels to which the width of a picture is about reduced"""
_APART_S: Final = 0.055
_OLDEST_S: Final = 0.4
"""Ages between earlier pictures, and of the oldest one that is kept"""
_LEAST: Final = 0.25
_FALLS: Final = 0.8
_RISES: Final = 1.05
"""Least noise, and by which factors it follows one picture: what moves looks like noise, too"""


class Snapshot(NamedTuple):
    """Every so manieth pixel of a picture."""

    taken_s: float
    pose: CameraPose
    depth_m: DepthArray
    """(h, w) depth with support; 0: none"""
    normals: DepthArray
    """(h, w, 3) normals, in the camera's frame; 0: unknown"""
    own: LabelArray
    """(h, w) 1 where the robot is"""
    view: FloatArray
    """Numbers of a view whose pixels are the coarser ones"""

    @property
    def arrays(self) -> tuple[DepthArray, DepthArray, LabelArray, FloatArray]:
        """Arguments of the kernels"""
        return self.depth_m, self.normals, self.own, self.view


def snapshot(
    picture: DepthPicture,
    pose: CameraPose,
    errors: DepthErrors,
    depth_m: DepthArray,
    normals: DepthArray,
    own: LabelArray,
    noise: float,
) -> Snapshot:
    """Return a picture's coarser one. depth_m, normals, own: of all its pixels. noise: factor on the variance."""
    step = max(round(depth_m.shape[1] / _WIDTH), 1)
    fine, every = picture.pinhole, (slice(None, None, step),) * 2
    # The middle of each pixel that is kept stays where it is.
    middle = 0.5 - 0.5 / step
    coarse = Pinhole(fine.fx / step, fine.fy / step, fine.cx / step + middle, fine.cy / step + middle)
    by = math.sqrt(noise)
    scaled = replace(errors, growth_per_m=by * errors.growth_per_m, floor_m=by * errors.floor_m)
    view, kept = view_of(coarse, pose, scaled), np.ascontiguousarray
    return Snapshot(picture.taken_s, pose, kept(depth_m[every]), kept(normals[every]), kept(own[every]), view)


class Earlier:
    """One camera's earlier pictures."""

    def __init__(self) -> None:
        self._kept: deque[Snapshot] = deque()
        self.noise = 1.0
        """Variance of what stands still, as a share of that by the camera's errors: part of an error never changes"""

    def measure(self, share: float) -> None:
        """Let the noise follow what a picture had, as a share of the noise that was assumed."""
        self.noise = min(max(self.noise * min(max(share, _FALLS), _RISES), _LEAST), 1.0)

    def add(self, newest: Snapshot) -> None:
        """Keep a picture, if it is not too close to the one before; forget old ones. Clocks that jump forget all."""
        kept = self._kept
        if kept and newest.taken_s < kept[-1].taken_s:
            kept.clear()
        while kept and newest.taken_s - kept[0].taken_s > _OLDEST_S:
            kept.popleft()
        if not kept or newest.taken_s - kept[-1].taken_s >= _APART_S:
            kept.append(newest)

    def of_age(self, now_s: float, age_s: float, newest: Snapshot) -> Snapshot | None:
        """Return the picture whose age is closest to `age_s`; None if there is none of the newest one's size."""
        usable = [one for one in self._kept if one.depth_m.shape == newest.depth_m.shape and now_s > one.taken_s]
        return min(usable, key=lambda one: abs(now_s - one.taken_s - age_s), default=None)


UNKNOWN: Final = 0
SURFACE: Final = 1
FREE: Final = 2
"""What an earlier picture says about a place: nothing, a surface, or that nothing was there"""
_INSIDE: Final = 1.1, 0.95
"""Factors on the range within which something would have been measured"""


@building_block
def _is_hole(depth_m: DepthArray, own: LabelArray, row: int, column: int) -> bool:
    """Return whether nothing at all is measured in nine pixels, of which none is the robot's."""
    if row < 1 or column < 1 or row >= depth_m.shape[0] - 1 or column >= depth_m.shape[1] - 1:
        return False
    for i in range(row - 1, row + 2):
        for j in range(column - 1, column + 2):
            if depth_m[i, j] > 0.0 or own[i, j]:
                return False
    return True


@building_block
def surface_at(
    point: Vector, depth_m: DepthArray, normals: DepthArray, own: LabelArray, view: FloatArray
) -> tuple[int, float, float, Vector]:
    """Return how far a point is before the surface of an earlier picture, along that surface's normal.

    The answer is what is known there, the distance, its variance by the picture, and the normal (world).
    """
    a = to_camera(view, point)
    if a[2] <= 0.0:
        return UNKNOWN, 0.0, 0.0, point
    i, j = pixel_of(view, a)
    if i < 0 or j < 0 or i >= depth_m.shape[0] or j >= depth_m.shape[1] or own[i, j]:
        return UNKNOWN, 0.0, 0.0, point
    z, normal = 1.0 * depth_m[i, j], (1.0 * normals[i, j, 0], 1.0 * normals[i, j, 1], 1.0 * normals[i, j, 2])
    if z <= 0.0:
        measurable = _INSIDE[0] * view[LEAST] < a[2] < _INSIDE[1] * view[MOST]
        return FREE if measurable and _is_hole(depth_m, own, i, j) else UNKNOWN, 0.0, 0.0, point
    if dot(normal, normal) == 0.0:
        return UNKNOWN, 0.0, 0.0, point
    x, y = ray_at(view, i, j)
    along = dot(normal, (x, y, 1.0))
    before = dot(normal, a) - z * along
    return SURFACE, before, (sd_at(view, z) * along) ** 2, turned_to_world(view, normal)
