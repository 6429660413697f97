"""Mount of a depth camera, solved from what it sees of the robot's own surface.

Measured points are brought onto the planes of the surface at its nearest points, by robust least squares over a turn
and a shift. Points farther away than a bound, which shrinks, are left out.
"""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.commissioning.depth_figures import Look
from robot_side.depth.camera_settings import LinkMount
from robot_side.depth.picture import CameraPose
from robot_side.depth.support import normals, supported
from robot_side.depth.view import view_of
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot

_BOUNDS_M: Final = (0.1, 0.07, 0.05, 0.035, 0.025, 0.015, 0.015, 0.015)
_ACROSS: Final = 80
"""Points across a picture that are used"""
_FEW: Final = 80
_ALIKE: Final = 0.7
"""Least cosine of the angle between a measured normal and that of the surface"""
_MODEL_M: Final = 1e-3
"""Standard deviation by which a robot's surface differs from its model"""
_HUBER: Final = 2.0
_BEHIND_M: Final = 0.02
_SEEN_THROUGH: Final = 0.25
"""Share of the surface behind which something is measured, from which on the mount is wrong"""
_PRIOR: Final = np.repeat((0.3, 0.1), 3)
"""Standard deviations, in rad and m, of what no point tells"""
_SURE_M, _SURE_RAD = 0.005, math.radians(1.0)
_FAR: Final = "the first guess has to be right within 40 mm and 2°"
WAYS: Final = ("right in the picture", "down in the picture", "along the view")
"""Axes of a camera in words"""
_PARTS: Final = slice(0, 3), slice(3, 6)


class Solved(NamedTuple):
    """Correction of a mount, in the frame of the camera as it was believed."""

    turn: FloatArray
    """(3, 3) rotation, from the right camera's frame to the believed one's"""
    shift_m: FloatArray
    """(3,) place of the right camera"""
    at_m: FloatArray
    """(3,) middle of the points on the robot, in the right camera's frame"""
    covariance: FloatArray
    """(6, 6) of the turn in rad, and of the shift in m of what is at the middle, along the camera's axes"""
    points: int
    before_m: float
    """Median distance of points from the surface, by the believed mount"""
    after_m: float

    def corrected(self, mount: LinkMount) -> LinkMount:
        """Return the right mount."""
        axes = mount.axes()
        x, y, z = (np.array(mount.position_m) + axes @ self.shift_m).tolist()
        w, i, j, k = Rotation.from_matrix(axes @ self.turn).as_quat(canonical=True, scalar_first=True).tolist()
        return LinkMount((x, y, z), (w, i, j, k), mount.link)

    def worst(self) -> tuple[float, str, float, str]:
        """Return the largest standard deviations, in m and of the turn in rad, each with its direction in words."""
        (turns, axes), (shifts, ways) = (np.linalg.eigh(self.covariance[part, part]) for part in _PARTS)
        way, axis = (WAYS[int(np.abs(vectors[:, -1]).argmax())] for vectors in (ways, axes))
        return math.sqrt(shifts[-1]), way, math.sqrt(turns[-1]), axis


class Refused(NamedTuple):
    """Why no mount is told."""

    why: str
    remedy: str


class _Sampled:
    """Pixels of a look."""

    def __init__(self, look: Look) -> None:
        pinhole, view = look.picture.pinhole, view_of(look.picture.pinhole, look.pose, look.errors)
        kept = supported(np.ascontiguousarray(look.picture.depth_m), view)
        (height, width), errors = kept.shape, look.errors
        every = max(1, width // _ACROSS)
        rows, columns = (grid.ravel() for grid in np.mgrid[:height:every, :width:every])
        self._look, self.depths_m = look, kept[rows, columns].astype(float)
        x, y = (columns + 0.5 - pinhole.cx) / pinhole.fx, (rows + 0.5 - pinhole.cy) / pinhole.fy
        self._rays = np.stack([x, y, np.ones(len(x))], axis=1)
        found = normals(kept, view)[rows, columns].astype(float)
        usable = found.any(axis=1)
        self._points_m, self._normals = (self._rays * self.depths_m[:, None])[usable], found[usable]
        # Neighbours err alike, and so count less.
        alike = max(1.0, 2.0 * errors.correlation * pinhole.fx / every)
        self._sds_m = alike * np.hypot(errors.floor_m + errors.growth_per_m * self._points_m[:, 2] ** 2, _MODEL_M)

    def surface(self, robot: PosedRobot, turn: FloatArray, shift_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return depths of the robot's surface, infinite where the camera measures none, and normals."""
        look, believed = self._look, self._look.pose.rotation
        robot.pose(look.arm, look.fingers)
        pose = CameraPose(look.pose.position_m + believed @ shift_m, believed @ turn)
        depths_m, ways = robot.surface(pose, self._rays)
        return np.where(depths_m >= look.errors.least_m, depths_m, np.inf), ways

    def pairs(self, robot: PosedRobot, turn: FloatArray, shift_m: FloatArray, bound_m: float) -> FloatArray:
        """Return measured points (k, 3) with place and normal of the surface, and standard deviations: (k, 10)."""
        depths_m, ways = self.surface(robot, turn, shift_m)
        seen = np.isfinite(depths_m)
        if not seen.any():
            return np.empty((0, 10))
        places_m, ways = self._rays[seen] * depths_m[seen, None], ways[seen]
        away_m, nearest = cKDTree(places_m).query(self._points_m)
        near = (away_m <= bound_m) & ((self._normals * ways[nearest]).sum(axis=1) >= _ALIKE)
        found: FloatArray = np.column_stack([self._points_m, places_m[nearest], ways[nearest], self._sds_m])[near]
        return found


def solve_mount(looks: Sequence[Look], robot: PosedRobot) -> Solved | Refused:
    """Return what makes the robot's surface fit the looks of one camera best; at least one look.

    It is refused if too little is seen, if the first guess is too far, or if some direction is not determined.
    """
    sampled = [_Sampled(look) for look in looks]
    turn, shift_m, before_m = np.eye(3), np.zeros(3), math.nan
    for bound_m in _BOUNDS_M:
        pairs = np.concatenate([one.pairs(robot, turn, shift_m, bound_m) for one in sampled])
        if len(pairs) < _FEW:
            said = f"{len(pairs)} points are on the robot's surface; valid: {_FEW} or more"
            return Refused(said, f"more of the arm in the picture, within the camera's range; {_FAR}")
        points_m, places_m, ways, sds_m = pairs[:, :3], pairs[:, 3:6], pairs[:, 6:9], pairs[:, 9]
        at_m, off_m = points_m.mean(axis=0), ((points_m - places_m) * ways).sum(axis=1)
        before_m = before_m if np.isfinite(before_m) else float(np.median(np.abs(off_m)))
        # What a step leaves of large turns, the next one takes; what no point tells stays as it is.
        slopes = np.hstack([np.cross(points_m - at_m, ways), ways]) / sds_m[:, None]
        slopes, start = np.vstack([slopes, np.diag(1.0 / _PRIOR)]), np.concatenate([off_m / sds_m, np.zeros(6)])
        best = least_squares(_left, np.zeros(6), loss="huber", f_scale=_HUBER, args=(slopes, start))
        step = Rotation.from_rotvec(best.x[:3]).as_matrix()
        shift_m = shift_m + turn @ (at_m + best.x[3:] - step @ at_m)
        turn = turn @ step
    expected_m = np.concatenate([one.surface(robot, turn, shift_m)[0] for one in sampled])
    depths_m = np.concatenate([one.depths_m for one in sampled])
    judged = np.isfinite(expected_m) & (depths_m > 0.0)
    if (share := float(np.mean((depths_m - expected_m)[judged] > _BEHIND_M))) > _SEEN_THROUGH:
        return Refused(f"{share:.0%} of the robot's surface is seen through: it is not there", _FAR)
    left = np.abs(_left(best.x, slopes, start))[:-6]
    # Residuals may be larger than is allowed for.
    excess = max(1.0, float(np.median(left)) / 0.6745)
    covariance = excess**2 * np.linalg.inv(slopes.T @ slopes)
    after_m = float(np.median(left * sds_m))
    found = Solved(turn, shift_m, at_m, covariance, len(pairs), before_m, after_m)
    sd_m, way, sd_rad, axis = found.worst()
    if sd_m <= _SURE_M and sd_rad <= _SURE_RAD:
        return found
    said = f"not determined: {1e3 * sd_m:.0f} mm {way} and {math.degrees(sd_rad):.1f}° about what is {axis}"
    valid = f"standard deviations up to {1e3 * _SURE_M:.0f} mm and {math.degrees(_SURE_RAD):.0f}°"
    return Refused(f"{said}; valid: {valid}", "more poses, and more of the arm: surfaces that face different ways")


def _left(six: FloatArray, slopes: FloatArray, start: FloatArray) -> FloatArray:
    return start + slopes @ six
