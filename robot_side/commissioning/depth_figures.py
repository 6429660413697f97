"""Figures of the pictures of depth cameras, which are looked at and not mapped."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.depth.own_body import beyond_m
from robot_side.depth.perception import DepthPerception
from robot_side.depth.picture import CameraPose, DepthErrors, DepthPicture, OwnBody, Pinhole
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import SlotChanges
from robot_side.depth.support import supported
from robot_side.depth.view import view_of

NEAR_M: Final = 0.03
"""Distance from the robot's solids within which a measured point counts as one on them"""
_POINTS: Final = 4000
"""Points of a picture that are held against the solids"""
_STILL: Final = 0.005
"""Change of a joint up to which the arm stands, in rad or m"""
_ANOTHER: Final = 0.05
"""Change of a joint that makes another pose"""
_SETTLED_S: Final = 0.2
_MOST_LOOKS: Final = 30
_NO_MAP: Final = MapSettings(lower_m=(0.0, 0.0, 0.0), upper_m=(0.1, 0.1, 0.1), slots=64)


@dataclass(frozen=True, eq=False)
class PictureFigures:
    """What one picture was like."""

    age_s: float
    """Age at which it was looked at, at most"""
    width: int
    height: int
    pinhole: Pinhole
    errors: DepthErrors
    """What is allowed for"""
    holes: float
    """Share of the pixels in which nothing was measured"""
    out_of_range: float
    """Share of the pixels whose depth the camera is not taken to measure"""
    without_support: float
    """Share of the pixels with which too few neighbours agree"""
    depths_m: FloatArray
    """(3,) depths: of the nearest hundredth, half, and all but a hundredth of the measured pixels; NaN without any"""
    beyond_m: FloatArray
    """(k,) signed distances of points from the robot's own surface, up to `NEAR_M`"""


@dataclass(frozen=True, eq=False)
class Look:
    """Picture beside an arm that stands."""

    picture: DepthPicture
    pose: CameraPose
    """Pose of the camera as it is believed"""
    arm: FloatArray
    """(n,) positions of the arm's joints"""
    fingers: FloatArray
    """(f,) positions of the fingers' joints"""
    errors: DepthErrors


class LookedAt(DepthPerception):
    """Stands where a map would, and keeps the figures of each camera's pictures."""

    def __init__(self) -> None:
        super().__init__(_NO_MAP)
        self.now_s = 0.0
        """Time at which pictures are looked at"""
        self.figures: dict[int, list[PictureFigures]] = {}
        """Figures by the camera's number"""
        self.looks: dict[int, list[Look]] = {}
        """One picture from each pose in which the arm stood, by the camera's number"""
        self._arm = self._fingers = np.empty(0)
        self._stands_since_s = np.inf

    def stand(self, now_s: float, arm: FloatArray, fingers: FloatArray) -> None:
        """Take where the joints of arm (n,) and fingers (f,) are."""
        if len(arm) != len(self._arm) or np.abs(np.subtract(arm, self._arm)).max() > _STILL:
            self._arm, self._fingers, self._stands_since_s = np.array(arm), np.array(fingers), now_s

    def see(self, picture: DepthPicture, pose: CameraPose, body: OwnBody, errors: DepthErrors, camera: int) -> None:
        """Keep the picture's figures."""
        found = figures_of(picture, pose, body, errors, self.now_s)
        self.figures.setdefault(camera, []).append(found)
        looks = self.looks.setdefault(camera, [])
        stands = picture.taken_s >= self._stands_since_s + _SETTLED_S
        if stands and len(looks) < _MOST_LOOKS and all(np.abs(self._arm - one.arm).max() > _ANOTHER for one in looks):
            looks.append(Look(picture, pose, self._arm, self._fingers, errors))

    def changes(self, near_m: FloatArray, *, holds: bool = False) -> SlotChanges:
        """Return that nothing is mapped."""
        del near_m, holds
        return self.whole()


def figures_of(
    picture: DepthPicture, pose: CameraPose, body: OwnBody, errors: DepthErrors, now_s: float
) -> PictureFigures:
    """Return the figures of a picture; arguments as for `DepthPerception.see`."""
    depth_m = np.ascontiguousarray(picture.depth_m)
    kept = supported(depth_m, view_of(picture.pinhole, pose, errors))
    measured = depth_m > 0.0
    valid = (depth_m >= errors.least_m) & (depth_m <= errors.most_m)
    depths_m: FloatArray = (
        np.quantile(depth_m[measured].astype(float), (0.01, 0.5, 0.99)) if measured.any() else np.full(3, np.nan)
    )
    away_m = beyond_m(_points(kept, picture.pinhole, pose), body)
    return PictureFigures(
        age_s=now_s - picture.taken_s,
        width=depth_m.shape[1],
        height=depth_m.shape[0],
        pinhole=picture.pinhole,
        errors=errors,
        holes=1.0 - float(measured.mean()),
        out_of_range=float((measured & ~valid).mean()),
        without_support=float((valid & (kept == 0.0)).mean()),
        depths_m=depths_m,
        beyond_m=away_m[np.abs(away_m) <= NEAR_M],
    )


def _points(depth_m: np.ndarray, pinhole: Pinhole, pose: CameraPose) -> FloatArray:
    """Return measured points (n, 3) in the world frame, evenly drawn from the picture."""
    rows, columns = np.nonzero(depth_m)
    every = max(1, len(rows) // _POINTS)
    rows, columns = rows[::every], columns[::every]
    z = depth_m[rows, columns].astype(np.float64)
    x, y = (columns + 0.5 - pinhole.cx) / pinhole.fx * z, (rows + 0.5 - pinhole.cy) / pinhole.fy * z
    points_m: FloatArray = pose.position_m + np.stack([x, y, z], axis=1) @ pose.rotation.T
    return points_m
