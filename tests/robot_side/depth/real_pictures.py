"""Real stereo pictures through the whole map, beside their truth: python -m tests.robot_side.depth.real_pictures.

The motorcycle of Middlebury 2014, as scikit-image's wheel has it. It is taken for a model of it at a quarter of its
size, so that its pictures are those of a camera like a D435: 995 pixels, 48 mm, things at 0.5 to 1.3 m.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.spatial import cKDTree
from skimage import data

from common.arrays import FloatArray
from feelahead.lab.posed_gripper import PosedGripper
from robot_side.depth.boxes import Boxes
from robot_side.depth.depth_map import DepthMap
from robot_side.depth.frames import SurfaceFrames
from robot_side.depth.picture import CameraPose, DepthErrors, DepthPicture, Pinhole
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import Slots
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.enlargement.distance import Uncertainty, standard_quantile
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.object_class import OBSTACLE
from robot_side.field.object_errors import largest_errors, object_errors
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from tests.robot_side.depth.mapping import NOBODY, fronts
from tests.robot_side.depth.stereo_matching import disparities

_PINHOLE: Final = Pinhole(994.978, 994.978, 311.193 + 0.5, 254.877 + 0.5)
_OFFSET_PX: Final = 31.086
_BASELINE_M: Final = 0.193001 / 4.0
_MOST_PX: Final = 80
_SD_PX: Final = 0.25
"""Standard deviation of matched disparities: 0.2 to 0.27 px were measured on this pair"""
ERRORS: Final = DepthErrors(
    _SD_PX / (_PINHOLE.fx * _BASELINE_M), least_m=0.3, most_m=1.4, correlation=7.5 / _PINHOLE.fx
)
_SETTINGS: Final = MapSettings(lower_m=(-0.5, -0.4, 0.3), upper_m=(0.6, 0.4, 1.4), slots=8192)
_PICTURES: Final = 5
_CAMERA_SD_M: Final = 1e-3
_START_M: Final = 0.12
"""Way from the gripper's start to its first contact"""


def pictures() -> tuple[FloatArray, FloatArray]:
    """Return the true depth (h, w), and the matched one, in m; 0 where there is none."""
    left, right, true_px = data.stereo_motorcycle()
    matched_px = disparities(left.astype(np.float64).mean(axis=2), right.astype(np.float64).mean(axis=2), _MOST_PX)
    factor = _PINHOLE.fx * _BASELINE_M
    true_m, matched_m = (np.nan_to_num(factor / (px + _OFFSET_PX), posinf=0.0) for px in (true_px, matched_px))
    return true_m, matched_m


def mapped(depth_m: FloatArray) -> Boxes:
    """Return the boxes after some pictures of the same depth."""
    depth_map = DepthMap(_SETTINGS)
    for k in range(_PICTURES):
        picture = DepthPicture(k / 15.0, depth_m.astype(np.float32), _PINHOLE)
        depth_map.integrate(picture, CameraPose(np.zeros(3), np.eye(3)), NOBODY, ERRORS)
    return depth_map.boxes()


def points_of(depth_m: FloatArray) -> FloatArray:
    """Return the points (n, 3) of all pixels with depth, in the camera's frame."""
    rows, columns = np.nonzero(depth_m)
    z = depth_m[rows, columns]
    across, down = (columns + 0.5 - _PINHOLE.cx) / _PINHOLE.fx, (rows + 0.5 - _PINHOLE.cy) / _PINHOLE.fy
    return np.stack([across * z, down * z, z], axis=1)


@dataclass(frozen=True)
class Off:
    """Distances of the boxes' fronts from the true surface, weighted by area."""

    within: float
    """Share within three standard deviations of a pixel there"""
    median_m: float
    p90_m: float


def fronts_off(boxes: Boxes, true_m: FloatArray) -> Off:
    """Compare 16 points of each front with the nearest true point, where the truth is known."""
    corners = fronts(boxes)
    shares = np.stack(np.meshgrid((0.125, 0.375, 0.625, 0.875), (0.125, 0.375, 0.625, 0.875)), axis=-1).reshape(-1, 2)
    a, b = shares[:, :1], shares[:, 1:]
    ways = corners[:, None, 1] - corners[:, None, 0], corners[:, None, 2] - corners[:, None, 0]
    points = (corners[:, None, 0] + b * ways[0] + a * ways[1]).reshape(-1, 3)
    areas = np.repeat(boxes.half_sizes_m[:, :2].prod(axis=1), len(shares))
    columns = np.floor(_PINHOLE.fx * points[:, 0] / points[:, 2] + _PINHOLE.cx).astype(int)
    rows = np.floor(_PINHOLE.fy * points[:, 1] / points[:, 2] + _PINHOLE.cy).astype(int)
    height, width = true_m.shape
    known = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    known[known] = true_m[rows[known], columns[known]] > 0.0
    away_m: FloatArray = np.asarray(cKDTree(points_of(true_m)).query(points[known])[0])
    sds_m, weights = ERRORS.growth_per_m * points[known, 2] ** 2, areas[known] / areas[known].sum()
    order = np.argsort(away_m)
    middle, most = np.searchsorted(np.cumsum(weights[order]), (0.5, 0.9))
    within = float(weights[away_m <= 3.0 * sds_m].sum())
    return Off(within, float(away_m[order[middle]]), float(away_m[order[most]]))


class Approach:
    """The built-in gripper, which advances along the camera's axis."""

    def __init__(self, true_m: FloatArray) -> None:
        gripper = PosedGripper(load_scene())
        pose = gripper.at(gripper.home_rad)
        centers_m = (pose.sphere_centers_m - pose.tool_position_m) @ pose.tool_rotation
        still = np.zeros_like(pose.tool_jacobian)
        self._pose = replace(
            pose, tool_position_m=np.zeros(3), tool_rotation=np.eye(3), tool_jacobian=still, sphere_centers_m=centers_m
        )
        self._ahead, self._points_m = Ahead(np.zeros(pose.tool_jacobian.shape[1])), points_of(true_m)
        self._across = cKDTree(self._points_m[:, :2])

    def contact_m(self, x_m: float, y_m: float) -> float:
        """Return how far along z the gripper comes from z = 0 until it touches a true point; infinity if never."""
        least = np.inf
        for center_m, radius_m in zip(self._pose.sphere_centers_m, self._pose.sphere_radii_m, strict=True):
            middle_m = center_m[:2] + np.array([x_m, y_m])
            near_m = self._points_m[self._across.query_ball_point(middle_m, radius_m)]
            beside2_m2 = ((near_m[:, :2] - middle_m) ** 2).sum(axis=1)
            reach_m = near_m[:, 2] - np.sqrt(radius_m**2 - beside2_m2) - center_m[2]
            least = min(least, float(reach_m.min(initial=np.inf)))
        return least

    def early_m(self, objects: PerceivedObjects, probability: float, x_m: float, y_m: float) -> float:
        """Return by how much full strength begins before the contact; below 0 after it, -infinity if never."""
        start_m = self.contact_m(x_m, y_m) - _START_M
        shift_m = np.array([x_m, y_m, start_m])
        pose = replace(self._pose, tool_position_m=shift_m, sphere_centers_m=self._pose.sphere_centers_m + shift_m)
        uncertainty = Uncertainty(probability, camera_sd_m=_CAMERA_SD_M)
        of_objects = object_errors(objects, uncertainty)
        unseen_m, variance_m2 = largest_errors(of_objects, uncertainty)
        quantile = float(standard_quantile(probability))
        axis, reach_m = np.array([0.0, 0.0, 1.0]), _START_M + 0.05
        along = Along(axis, 0.0, variance_m2, quantile, reach_m, unseen_m=unseen_m, of_objects=of_objects)
        classes = np.full(len(objects.names), OBSTACLE)
        return _START_M - float(self._ahead.look(pose, scene_table(objects), classes, along).fast_m[7])

    def places_m(self) -> FloatArray:
        """Return lateral places (n, 2) of the tool: at the foremost contact first, then all over the picture."""
        x_m, y_m = np.meshgrid(np.linspace(-0.1, 0.15, 11), np.linspace(-0.1, 0.1, 9))
        places_m = np.stack([x_m.ravel(), y_m.ravel()], axis=1)
        ways_m = np.array([self.contact_m(*place) for place in places_m.tolist()])
        found: FloatArray = places_m[np.argsort(ways_m)[: np.count_nonzero(np.isfinite(ways_m))]]
        return found


def perceived(boxes: Boxes) -> PerceivedObjects:
    """Return the frame that the law gets of boxes."""
    slots = Slots(_SETTINGS.slots)
    frames = SurfaceFrames(_SETTINGS.slots, _CAMERA_SD_M, 0.0)
    frames.take(slots.update(boxes, np.zeros(3), ERRORS), (0.0, 0.0))
    return frames.at(0.0)


def show() -> None:
    """Print the table."""
    true_m, matched_m = pictures()
    known = (true_m > 0.0) & (matched_m > 0.0)
    off_px = _PINHOLE.fx * _BASELINE_M * (1.0 / matched_m[known] - 1.0 / true_m[known])
    sd_px = 1.4826 * np.median(np.abs(off_px - np.median(off_px)))
    print(
        f"matched {(matched_m > 0.0).mean():.0%}, sd {sd_px:.2f} px, {(np.abs(off_px) > 3.0).mean():.1%} over 3 px off"
    )
    approach = Approach(true_m)
    places_m = approach.places_m().tolist()
    print(f"| depth | boxes | within 3 sd | off, median and p90, mm | early at the foremost, P 0.5 and 0.9, mm |"
          f" in time at {len(places_m)} places, P 0.9 |\n|---|---|---|---|---|---|")  # fmt: skip
    for name, depth_m in (("true", true_m), ("matched", matched_m)):
        boxes = mapped(depth_m)
        off, objects = fronts_off(boxes, true_m), perceived(boxes)
        first = [1e3 * approach.early_m(objects, probability, *places_m[0]) for probability in (0.5, 0.9)]
        early_mm = 1e3 * np.array([approach.early_m(objects, 0.9, *place) for place in places_m])
        print(
            f"| {name} | {len(boxes.ids)} | {off.within:.1%} | {1e3 * off.median_m:.1f}, {1e3 * off.p90_m:.1f}"
            f" | {first[0]:.1f}, {first[1]:.1f} | {(early_mm >= 0.0).mean():.0%},"
            f" median {np.median(early_mm):.1f}, {early_mm.min():.1f} to {early_mm.max():.1f} mm |"
        )


if __name__ == "__main__":
    show()
