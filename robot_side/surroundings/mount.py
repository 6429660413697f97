"""Mount of a camera: its place and direction in the frame of what carries it."""

import math
from dataclasses import dataclass
from typing import Annotated, Final

from msgspec import Meta
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.limits import check_value

_Coordinate = Annotated[float, Meta(ge=-100.0, le=100.0)]
_UNIT: Final = 0.01
"""Largest deviation of a quaternion's length from 1 that is accepted"""


@dataclass(frozen=True)
class Mount:
    """Pose of a camera in the frame of what carries it."""

    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    """From the camera's frame, whose x is right, y down and z ahead in its picture; w first."""

    def __post_init__(self) -> None:
        for value in self.position_m:
            check_value("position_m", value, _Coordinate)
        if not abs(math.hypot(*self.quaternion) - 1.0) <= _UNIT:
            raise ValueError(f"quaternion = {self.quaternion}; valid: a quaternion of length 1, w first")

    def axes(self) -> FloatArray:
        """Return the camera's axes as columns (3, 3), in the frame of what carries it."""
        axes: FloatArray = Rotation.from_quat(self.quaternion, scalar_first=True).as_matrix()
        return axes
