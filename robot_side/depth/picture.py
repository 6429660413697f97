"""Depth pictures, where their camera was, and how far it may err."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from common.roles import Role

DepthArray = npt.NDArray[np.float32]
LabelArray = npt.NDArray[np.uint8]

SPHERE: Final = 2
CAPSULE: Final = 3
ELLIPSOID: Final = 4
CYLINDER: Final = 5
BOX: Final = 6
"""Kinds of solids, by MuJoCo's numbers of geoms"""
SOLID_NUMBERS: Final = 16
"""Kind, centre (3), rotation by rows (9) and sizes (3) of a solid"""
UNLABELLED: Final = 0
"""Label of a pixel about which the segmentation says nothing"""


@dataclass(frozen=True)
class Pinhole:
    """Intrinsics in pixels; the centre of the upper left pixel is at (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True, eq=False)
class DepthPicture:
    """Distance along the optical axis of what each pixel shows."""

    taken_s: float
    """Earliest possible time at which it was taken, in s, on our clock"""
    depth_m: DepthArray
    """(h, w) depth; 0 where nothing was measured"""
    pinhole: Pinhole
    labels: LabelArray | None = None
    """(h, w) labels of a segmentation; 0: none. None: there is no segmentation."""
    roles: Mapping[int, Role] = field(default_factory=dict)
    """Roles by label; others have none"""


@dataclass(frozen=True, eq=False)
class CameraPose:
    """Pose of a camera in the world frame."""

    position_m: FloatArray
    """(3,) position"""
    rotation: FloatArray
    """(3, 3) rotation, camera to world; the camera's x is right, y down and z ahead in its picture"""


@dataclass(frozen=True)
class DepthErrors:
    """Standard deviation of a camera's depth at z, floor_m + growth_per_m z², and the range in which it measures.

    For stereo, growth_per_m = σ_px / (f B): errors of disparity σ_px and focal length f in pixels, baseline B in m.
    """

    growth_per_m: float
    floor_m: float = 0.0
    least_m: float = 0.17
    most_m: float = 3.0
    correlation: float = 0.0
    """Angle in rad at which the correlation of two pixels' errors falls to 1/e: their distance over the focal length"""

    def sd_m(self, depth_m: float) -> float:
        """Return the standard deviation in m of one pixel at `depth_m`."""
        return self.floor_m + self.growth_per_m * depth_m * depth_m


@dataclass(frozen=True, eq=False)
class OwnBody:
    """Solids of the robot, of what it holds, and of known models, in the world frame: (n,) kinds.

    Sizes are as MuJoCo gives them.
    """

    kinds: npt.NDArray[np.int64]
    positions_m: FloatArray
    """(n, 3) centres"""
    rotations: FloatArray
    """(n, 3, 3) rotations, solid to world"""
    sizes_m: FloatArray
    """(n, 3) sizes: radius; radius and half length; half axes; radius and half length; half sizes"""
    models: int = field(default=0, kw_only=True)
    """Number of solids, the last ones, that are known models: no surface stays near these"""
    held: int = field(default=0, kw_only=True)
    """Number of solids, those before the models, that are what the robot holds"""

    def known(self) -> "OwnBody":
        """Return the known models alone."""
        first = len(self.kinds) - self.models
        return self._some(slice(first, None), models=self.models)

    def carried(self) -> "OwnBody":
        """Return what the robot holds alone."""
        end = len(self.kinds) - self.models
        return self._some(slice(end - self.held, end), held=self.held)

    def _some(self, rows: slice, *, models: int = 0, held: int = 0) -> "OwnBody":
        placed = self.positions_m[rows], self.rotations[rows]
        return OwnBody(self.kinds[rows], *placed, self.sizes_m[rows], models=models, held=held)
