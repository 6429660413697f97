"""Depth pictures of scenes of planes, boxes, balls and rods, by casting rays, with noise alike in neighbours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.depth.picture import CameraPose, DepthErrors, DepthPicture, Pinhole

STEREO = DepthErrors(growth_per_m=0.08 / (424.0 * 0.05), least_m=0.17, most_m=3.0)
"""A stereo camera of 848 pixels and 50 mm, with 0.08 pixels of error"""


@dataclass(frozen=True)
class Box:
    """Box along the axes of the world."""

    center_m: tuple[float, float, float]
    half_m: tuple[float, float, float]

    def hit(self, start: FloatArray, rays: FloatArray) -> FloatArray:
        """Return how far along each ray (n, 3) it is hit; infinity if it is not."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = (np.stack([np.subtract(self.center_m, self.half_m), np.add(self.center_m, self.half_m)]) - start)[
                :, None
            ] / rays
        enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
        return np.where((enter <= leave) & (enter > 0.0), enter, np.inf)


@dataclass(frozen=True)
class Ball:
    """Ball."""

    center_m: tuple[float, float, float]
    radius_m: float

    def hit(self, start: FloatArray, rays: FloatArray) -> FloatArray:
        """Return how far along each ray (n, 3) it is hit; infinity if it is not."""
        return _first_root(rays, start - np.array(self.center_m), self.radius_m)


@dataclass(frozen=True)
class Rod:
    """Upright rod without ends."""

    x_m: float
    y_m: float
    radius_m: float

    def hit(self, start: FloatArray, rays: FloatArray) -> FloatArray:
        """Return how far along each ray (n, 3) it is hit; infinity if it is not."""
        return _first_root(rays[:, :2], start[:2] - np.array([self.x_m, self.y_m]), self.radius_m)


Thing = Box | Ball | Rod


@dataclass(frozen=True)
class Camera:
    """Camera of one pinhole and pose."""

    pose: CameraPose
    width: int = 320
    height: int = 240
    errors: DepthErrors = STEREO

    @property
    def pinhole(self) -> Pinhole:
        """Intrinsics with 58 degrees of height"""
        f = 0.5 * self.height / np.tan(np.radians(29.0))
        return Pinhole(f, f, 0.5 * self.width, 0.5 * self.height)

    def depth_m(self, things: Sequence[Thing]) -> FloatArray:
        """Return the true depth (h, w); 0 where nothing is hit."""
        pinhole = self.pinhole
        x, y = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        rays = np.stack([(x - pinhole.cx) / pinhole.fx, (y - pinhole.cy) / pinhole.fy, np.ones_like(x)], axis=-1)
        rays = rays.reshape(-1, 3) @ self.pose.rotation.T
        # Rays have the length 1 along the optical axis, so that a hit's distance is its depth.
        found = np.min([thing.hit(self.pose.position_m, rays) for thing in things], axis=0)
        return np.where(np.isfinite(found), found, 0.0).reshape(self.height, self.width)

    def picture(
        self,
        things: Sequence[Thing],
        taken_s: float = 0.0,
        noise: np.random.Generator | None = None,
        level: float = 1.0,
    ) -> DepthPicture:
        """Return a picture; noise: draws errors of the camera's own size, times `level`."""
        z = self.depth_m(things)
        if noise is not None:
            z = np.where(z > 0.0, z + level * self.errors.growth_per_m * z * z * alike(noise, z.shape), 0.0)
        z[(z < self.errors.least_m) | (z > self.errors.most_m)] = 0.0
        return DepthPicture(taken_s, z.astype(np.float32), self.pinhole)


def looking(position_m: Sequence[float], at_m: Sequence[float]) -> CameraPose:
    """Return the pose of a camera that looks at a point, with the world's z upward in its picture."""
    position = np.array(position_m, dtype=float)
    ahead = np.array(at_m, dtype=float) - position
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return CameraPose(position, np.stack([right, np.cross(ahead, right), ahead], axis=1))


def alike(random: np.random.Generator, shape: tuple[int, int], sd_px: float = 1.5) -> FloatArray:
    """Return normal numbers (h, w) of variance 1 that are alike within a few pixels."""
    weights = np.exp(-0.5 * (np.arange(-5, 6) / sd_px) ** 2)
    weights /= np.sqrt((weights * weights).sum())
    raw = random.standard_normal((shape[0] + 10, shape[1] + 10))
    rows = sum(weight * raw[:, k : k + shape[1]] for k, weight in enumerate(weights))
    found: FloatArray = np.asarray(sum(weight * rows[k : k + shape[0]] for k, weight in enumerate(weights)))
    return found


def _first_root(rays: FloatArray, away: FloatArray, radius_m: float) -> FloatArray:
    a, b = (rays * rays).sum(axis=1), rays @ away
    rest = b * b - a * (away @ away - radius_m**2)
    with np.errstate(invalid="ignore"):
        first = (-b - np.sqrt(rest)) / a
    return np.where((rest >= 0.0) & (first > 0.0), first, np.inf)
