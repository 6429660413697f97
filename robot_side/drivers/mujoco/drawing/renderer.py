"""MuJoCo's off-screen renderer at its fastest, and where it looks from.

MuJoCo fixes the graphics backend when it is imported: choose it before (`off_screen.py`).
"""

from typing import Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from robot_side.drivers.mujoco.viewpoints import Triple

_BESIDE_GEOMS: Final = 1000
"""Capacity of a rendered scene for elements other than geoms: sites, tendons, skins"""


def fast_renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    """Return a renderer of pictures of this size, to be closed after use; the quality set in `model` is changed."""
    # Without these a picture takes a processor 3 ms instead of 65.
    model.vis.quality.offsamples = 0
    model.vis.quality.shadowsize = 0
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    renderer = mujoco.Renderer(model, height, width, max_geom=model.ngeom + _BESIDE_GEOMS)
    for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
        renderer.scene.flags[flag] = 0
    return renderer


def look_from(
    renderer: mujoco.Renderer,
    position_m: FloatArray | Triple,
    forward: FloatArray | Triple,
    up: FloatArray | Triple,
    fovy_deg: float,
) -> None:
    """Let an updated scene be seen from a pose: (3,) each, in the world frame; forward and up are unit vectors."""
    for camera in renderer.scene.camera:
        camera.pos, camera.forward, camera.up = position_m, forward, up
        top = camera.frustum_near * np.tan(np.radians(0.5 * fovy_deg))
        camera.frustum_bottom, camera.frustum_top = -top, top
        # A width of 0 takes the picture's aspect ratio.
        camera.frustum_center = camera.frustum_width = 0.0
