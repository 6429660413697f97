"""Errors of depth cameras, as parameters, and sets of these for cameras that one can buy."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from robot_side.depth.picture import DepthErrors

_D435_FOCAL_PX: Final = 447.0
_D435_BASELINE_M: Final = 0.05
"""848 pixels over 87°, and the distance between the imagers: Intel's data sheet of the D400 series"""


@dataclass(frozen=True)
class SensorErrors:
    """How a depth camera errs. A stereo camera measures disparity, f B / z, so errors are given in 1/z.

    A pixel's standard deviation at z is floor_m + growth_per_m z².
    """

    growth_per_m: float = 0.0
    """Standard deviation of 1/z, in 1/m: of the disparity over f B"""
    floor_m: float = 0.0
    """Standard deviation that does not depend on z"""
    step_per_m: float = 0.0
    """Step of 1/z, in 1/m: of the disparity over f B"""
    correlation_px: float = 0.0
    """Distance at which the correlation of two pixels' errors falls to 1/e, along rows or columns"""
    focal_px: float = 1.0
    """Focal length of the pictures whose pixels `correlation_px` counts"""
    constant_share: float = 0.0
    """Share of the variance whose error stays the same for a whole run"""
    mixed_share: float = 0.0
    """Share of the pixels at edges that lie somewhere between the near and the far surface"""
    edge_hole_share: float = 0.0
    """Share of the pixels at edges that measure nothing"""
    drop_out_share: float = 0.0
    """Share of all pixels that measure nothing in a picture"""
    least_m: float = 0.0
    most_m: float = math.inf
    """Range in which the camera measures"""
    latency_s: float = 0.0
    """Time from the exposure until the picture can be read"""

    def depth_errors(self, level: float = 1.0) -> DepthErrors:
        """Return what a map has to assume of a camera with `level` times these errors."""
        # Rounding errs evenly within a step.
        growth_per_m = level * math.hypot(self.growth_per_m, self.step_per_m / math.sqrt(12.0))
        correlation = self.correlation_px / self.focal_px
        return DepthErrors(growth_per_m, level * self.floor_m, self.least_m, self.most_m, correlation)


SENSORS: Final[Mapping[str, SensorErrors]] = MappingProxyType(
    {
        "d435": SensorErrors(
            # 0.08 px: Intel's figure for a well-tuned D400. Real pairs of pictures gave 0.2 to 0.27 px: level 3.
            growth_per_m=0.08 / (_D435_FOCAL_PX * _D435_BASELINE_M),
            # 1/32 px: Intel's paper on subpixel linearity.
            step_per_m=0.03125 / (_D435_FOCAL_PX * _D435_BASELINE_M),
            # Measured with a matcher of 5x5 px on a Middlebury pair: 0.87, 0.58, 0.37 at 1, 4, 8 px.
            correlation_px=7.5,
            focal_px=_D435_FOCAL_PX,
            # Assumed: a matcher errs alike while the scene stands still, and the projector's pattern does.
            constant_share=0.5,
            # The same pair: 23 % invalid at edges, 38 % of the rest off by more than 50 mm.
            mixed_share=0.3,
            edge_hole_share=0.23,
            # Assumed, from the usual demand of 99 % filled on a textured wall.
            drop_out_share=0.01,
            # 0.17 m at 848x480: librealsense 999; 3 m: the data sheet's recommended range.
            least_m=0.17,
            most_m=3.0,
            # 60 to 70 ms: librealsense 1242; 124 to 133 at 640x480: 4955.
            latency_s=0.065,
        ),
        "azure_kinect": SensorErrors(
            # Up to 17 mm to 3.5 m (Microsoft's specification; Tölgyessy 2021 confirms it). Assumed to grow with z².
            growth_per_m=0.017 / 3.5**2,
            # Assumed: its filter spans some pixels. The focal length is that of 640 pixels over 75°.
            correlation_px=1.5,
            focal_px=417.0,
            # Assumed: reflections from elsewhere stay as they are, and so does part of the 11 mm of systematic error.
            constant_share=0.5,
            # Assumed: most mixed pixels are known as such, and left out.
            mixed_share=0.1,
            edge_hole_share=0.5,
            drop_out_share=0.001,
            # Microsoft's specification of the mode NFOV unbinned.
            least_m=0.5,
            most_m=3.86,
            # 0.1 s at best, and 0.2 s as others measured: Azure-Kinect-Sensor-SDK 804, 816.
            latency_s=0.1,
        ),
        "ideal": SensorErrors(),
    }
)
"""Errors of cameras by name"""
