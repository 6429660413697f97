"""Clouds of points, and the pictures that a pinhole camera at their sensor's place would take of them."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray, IntArray
from robot_side.depth.picture import CameraPose, DepthArray, Pinhole

COORDINATES: Final = ("x", "y", "z")
_WHOLE_PX = 0.1
"""Largest distance of an organised cloud's points from their pixels' rays, for which they are a pinhole's picture"""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points that a sensor measured, row by row where its file says so."""

    points_m: FloatArray
    """(n, 3) points in the file's frame; not finite where nothing was measured"""
    shape: tuple[int, int] | None = None
    """Rows and columns (h, w) of an organised cloud; None: its points are in no order"""
    sensor: CameraPose | None = None
    """Pose of the sensor in the file's frame; None: at its origin, with z ahead"""


@dataclass(frozen=True)
class VirtualCamera:
    """Camera that sees a cloud in no order."""

    width: int = 320
    height: int = 240
    fovx_deg: float = 70.0
    """Horizontal field of view"""

    @property
    def pinhole(self) -> Pinhole:
        """Intrinsics, with the optical axis in the middle and square pixels"""
        focal_px = 0.5 * self.width / math.tan(math.radians(0.5 * self.fovx_deg))
        return Pinhole(focal_px, focal_px, 0.5 * self.width, 0.5 * self.height)


def coordinates(records: "npt.NDArray[np.void]") -> FloatArray:
    """Return the fields x, y, z (n, 3) of records (n,)."""
    points_m: FloatArray = np.stack([records[name].reshape(-1) for name in COORDINATES], axis=-1).astype(np.float64)
    return points_m


def depth_of(cloud: Cloud, camera: VirtualCamera) -> tuple[DepthArray, Pinhole]:
    """Return the depth (h, w) that the cloud's sensor saw, and its intrinsics.

    An organised cloud is its own picture if a pinhole took it. Any other is seen by `camera`: the nearest point wins.
    """
    seen_m = cloud.points_m
    if (sensor := cloud.sensor) is not None:
        seen_m = (seen_m - sensor.position_m) @ sensor.rotation
    ahead = np.flatnonzero((seen_m[:, 2] > 0.0) & np.isfinite(seen_m).all(axis=1))
    depth_m = seen_m[ahead, 2]
    right, down = seen_m[ahead, 0] / depth_m, seen_m[ahead, 1] / depth_m
    if cloud.shape is not None:
        pinhole = _fitted(right, down, *np.divmod(ahead, cloud.shape[1]))
        if pinhole is not None:
            own_m = np.zeros(cloud.shape, dtype=np.float32)
            own_m.flat[ahead] = depth_m
            return own_m, pinhole
    pinhole = camera.pinhole
    columns, rows = np.floor(pinhole.fx * right + pinhole.cx), np.floor(pinhole.fy * down + pinhole.cy)
    inside = (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
    nearest_m = np.full(camera.height * camera.width, np.inf, dtype=np.float32)
    pixels = (rows[inside] * camera.width + columns[inside]).astype(np.int64)
    np.minimum.at(nearest_m, pixels, depth_m[inside].astype(np.float32))
    return np.where(np.isinf(nearest_m), np.float32(0.0), nearest_m).reshape(camera.height, camera.width), pinhole


def _fitted(right: FloatArray, down: FloatArray, rows: IntArray, columns: IntArray) -> Pinhole | None:
    """Return the pinhole whose rays through the pixels' centres pass the points; None if no pinhole's rays do."""
    found: list[float] = []
    for slope, pixels in ((right, columns), (down, rows)):
        terms = np.stack([slope, np.ones_like(slope)], axis=1)
        focal_px, center_px = np.linalg.lstsq(terms.T @ terms, terms.T @ (pixels + 0.5), rcond=None)[0]
        if not (focal_px > 0.0 and np.abs(terms @ (focal_px, center_px) - pixels - 0.5).max() < _WHOLE_PX):
            return None
        found += [float(focal_px), float(center_px)]
    return Pinhole(found[0], found[2], found[1], found[3])
