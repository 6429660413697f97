"""Mounts of real cameras, and the viewpoints that follow from these and from the pictures' intrinsics."""

import math
from dataclasses import dataclass
from typing import Annotated, Final, Protocol

import numpy as np
from msgspec import Meta
from scipy.spatial.transform import Rotation

from common.limits import check_limits, check_value
from common.protocol.view_messages import Eye

_Coordinate = Annotated[float, Meta(ge=-100.0, le=100.0)]
_UNIT: Final = 0.01
"""Largest deviation of a quaternion's length from 1 that is accepted"""


@dataclass(frozen=True)
class Mount:
    """Pose of a camera: in the tool's frame for the first-person view, in the world's for the overview."""

    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    """From the camera's frame, whose x is right, y down and z ahead in its picture; w first."""

    def __post_init__(self) -> None:
        for value in self.position_m:
            check_value("position_m", value, _Coordinate)
        if not abs(math.hypot(*self.quaternion) - 1.0) <= _UNIT:
            raise ValueError(f"quaternion = {self.quaternion}; valid: a quaternion of length 1, w first")


@dataclass(frozen=True)
class MountSettings:
    """Mounts of the cameras whose pictures are sent."""

    first_person: Mount | None = None
    overview: Mount | None = None

    def __post_init__(self) -> None:
        check_limits(self)


class Pinhole(Protocol):
    """Intrinsics of a picture, in pixels."""

    @property
    def fx(self) -> float:
        """Focal length along the picture's width"""
        ...

    @property
    def fy(self) -> float:
        """Focal length along the picture's height"""
        ...

    @property
    def cx(self) -> float:
        """Column, from the left edge, of what is straight ahead"""
        ...

    @property
    def cy(self) -> float:
        """Row, from the upper edge, of what is straight ahead"""
        ...


def mounted_eye(mount: Mount, pinhole: Pinhole, width: int, height: int) -> Eye:
    """Return the viewpoint of a camera with this mount, whose pictures have `width` x `height` pixels."""
    axes = Rotation.from_quat(mount.quaternion, scalar_first=True).as_matrix()
    half = 0.5 * height
    return Eye(
        position_m=mount.position_m,
        forward=_three(axes[:, 2]),
        up=_three(-axes[:, 1]),
        fovy_deg=math.degrees(2.0 * math.atan(half / pinhole.fy)),
        stretch=pinhole.fx / pinhole.fy,
        middle=((pinhole.cx - 0.5 * width) / half, (half - pinhole.cy) / half),
    )


def _three(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return (x, y, z)
