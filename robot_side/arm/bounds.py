"""Bounds of the tool's motion that the arm's owner sets: a workspace, and a greatest speed. Motion keeps them."""

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from msgspec import Meta

from common.arrays import FloatArray
from common.limits import check_limits, check_value
from robot_side.arm.limits import JointLimits

_Coordinate = Annotated[float, Meta(ge=-100.0, le=100.0)]
Place = tuple[_Coordinate, _Coordinate, _Coordinate]
_LEAST_S: Final = 0.25
"""Least time constant, in s, with which the tool comes up to a side of the workspace"""


@dataclass(frozen=True)
class Workspace:
    """Box in the world frame that the tool's point does not leave; its sides are felt as walls."""

    lower_m: Place
    upper_m: Place

    def __post_init__(self) -> None:
        for name in ("lower_m", "upper_m"):
            for value in getattr(self, name):
                check_value(name, value, _Coordinate)
        if not all(low < high for low, high in zip(self.lower_m, self.upper_m, strict=True)):
            raise ValueError(f"arm.workspace: upper_m = {self.upper_m}; valid: above lower_m = {self.lower_m} each")


@dataclass(frozen=True)
class Bounds:
    """Bounds of the tool's motion; none by default."""

    workspace: Workspace | None = None
    fastest_m_s: Annotated[float, Meta(gt=0.0, le=5.0)] | None = None

    def __post_init__(self) -> None:
        check_limits(self)

    def kept(self, linear_m_s: FloatArray, position_m: FloatArray, limits: JointLimits) -> FloatArray:
        """Return the velocity (3,) of the tool's point in the world frame that keeps the bounds.

        Towards a side of the workspace it falls with the distance, by a time constant in which the arm can stop.
        Along the side it remains. From outside, only the way back is left. limits: of the arm's joints.
        """
        kept = linear_m_s
        if self.workspace is not None:
            stops_s = float((limits.velocity_rad_s / limits.acceleration_rad_s2).max())
            constant_s = _LEAST_S + limits.response_s + stops_s
            up_m, down_m = self.workspace.upper_m - position_m, position_m - self.workspace.lower_m
            kept = np.clip(kept, -np.maximum(down_m, 0.0) / constant_s, np.maximum(up_m, 0.0) / constant_s)
        speed_m_s = float(np.linalg.norm(kept))
        if self.fastest_m_s is not None and speed_m_s > self.fastest_m_s:
            kept = kept * (self.fastest_m_s / speed_m_s)
        return kept

    def share(self, linear_m_s: FloatArray, position_m: FloatArray, limits: JointLimits) -> float:
        """Return the share, 0 to 1, of a motion with this velocity (3,) of the tool's point that keeps the bounds."""
        kept = self.kept(linear_m_s, position_m, limits)
        moves = np.abs(linear_m_s) > 1e-9
        return float(np.clip(kept[moves] / linear_m_s[moves], 0.0, 1.0).min(initial=1.0))


@dataclass(frozen=True)
class KeepOut:
    """Box in the world frame that is perceived as an obstacle, whatever a camera sees."""

    center_m: Place
    half_sizes_m: tuple[
        Annotated[float, Meta(gt=0.0, le=100.0)],
        Annotated[float, Meta(gt=0.0, le=100.0)],
        Annotated[float, Meta(gt=0.0, le=100.0)],
    ]
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Orientation, from the box's frame to the world's, w first"""

    def __post_init__(self) -> None:
        check_limits(self)
        if not abs(float(np.linalg.norm(self.quaternion)) - 1.0) < 0.01:
            raise ValueError(f"arm.keep_out: quaternion = {self.quaternion}; valid: of length 1, w first")
