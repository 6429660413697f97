"""Depth camera in the simulation: pictures of the true depth, and of what stands in each pixel."""

import copy
import math
from collections.abc import Mapping
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.roles import Role
from robot_side.depth.picture import UNLABELLED, CameraPose, DepthArray, DepthPicture, LabelArray, Pinhole
from robot_side.drivers.mujoco.drawing.renderer import fast_renderer, look_from

_LABELS: Final = range(1, 256)


class DepthCamera:
    """Depth camera without errors, at any pose. Close it after use, in the thread that made it.

    MuJoCo fixes the graphics backend when it is imported (`drawing/off_screen.py`).
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        width: int,
        height: int,
        fovy_deg: float,
        *,
        near_m: float = 0.01,
        far_m: float = 10.0,
        labels: Mapping[int, int] | None = None,
        roles: Mapping[int, Role] | None = None,
    ) -> None:
        """fovy_deg: vertical field of view. near_m, far_m: range in which surfaces are drawn.

        labels: label of each geom that has one; None: pictures have no labels. roles: by label.
        """
        if not 0.0 < near_m < far_m < math.inf:
            raise ValueError(f"near_m = {near_m}, far_m = {far_m}; valid: 0 < near_m < far_m")
        if wrong := set((labels or {}).values()).difference(_LABELS):
            raise ValueError(f"labels has {min(wrong)}; valid: 1 to 255")
        # The caller's model keeps its own quality and planes.
        model = copy.copy(model)
        model.vis.map.znear, model.vis.map.zfar = near_m / model.stat.extent, far_m / model.stat.extent
        self._renderer = fast_renderer(model, width, height)
        # Marks are drawn into the depth, too, so none may be seen.
        self._shown = mujoco.MjvOption()
        for group in (self._shown.sitegroup, self._shown.tendongroup, self._shown.actuatorgroup):
            group[:] = 0
        self._shown.flags[mujoco.mjtVisFlag.mjVIS_RANGEFINDER] = 0
        self._fovy_deg, self._far_m = fovy_deg, far_m
        focal_px = 0.5 * height / math.tan(math.radians(0.5 * fovy_deg))
        self.pinhole = Pinhole(focal_px, focal_px, 0.5 * width, 0.5 * height)
        self._roles = dict(roles or {})
        self._labels: LabelArray | None = None
        if labels is not None:
            # The last one is for what is no geom: MuJoCo's -1.
            self._labels = np.full(model.ngeom + 1, UNLABELLED, dtype=np.uint8)
            self._labels[list(labels)] = list(labels.values())

    def picture(self, data: mujoco.MjData, pose: CameraPose, taken_s: float) -> DepthPicture:
        """Return what the camera sees of `data`, whose kinematics are computed, from `pose`."""
        self._renderer.update_scene(data, scene_option=self._shown)
        axes = pose.rotation
        look_from(self._renderer, pose.position_m, axes[:, 2], -axes[:, 1], self._fovy_deg)
        self._renderer.enable_depth_rendering()
        depth_m: DepthArray = self._renderer.render()
        # Where there is no surface, the far plane is.
        depth_m[depth_m > 0.9999 * self._far_m] = 0.0
        return DepthPicture(taken_s, depth_m, self.pinhole, self._seen_labels(), self._roles)

    def close(self) -> None:
        """Free the graphics resources."""
        self._renderer.close()

    def __enter__(self) -> "DepthCamera":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _seen_labels(self) -> LabelArray | None:
        if self._labels is None:
            return None
        self._renderer.enable_segmentation_rendering()
        seen = self._renderer.render()
        # An enumeration would be compared pixel by pixel in Python.
        geoms = np.where(seen[:, :, 1] == int(mujoco.mjtObj.mjOBJ_GEOM), seen[:, :, 0], -1)
        labels: LabelArray = self._labels[geoms]
        return labels
