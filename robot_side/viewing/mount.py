"""Mounts of real cameras, and the viewpoints that follow from these and from the pictures' intrinsics."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from common.limits import check_limits
from common.protocol.view_messages import Eye
from robot_side.surroundings.mount import Mount


@dataclass(frozen=True)
class MountSettings:
    """Mounts of cameras whose pictures are sent: on the tool for the first-person view, else in the world."""

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
    axes = mount.axes()
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
