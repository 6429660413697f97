"""Off-screen rendering of a MuJoCo model; imported only if rendering works here (see `off_screen`)."""

import mujoco  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from common.protocol.view_messages import ViewName
from robot_side.drivers.mujoco.viewpoints import Viewpoint
from robot_side.viewing.exchange import Setup

_MODEL = "model.mjb"
_BESIDE_GEOMS = 1000
"""Capacity of a rendered scene for elements other than geoms: sites, tendons, skins"""


class Renderer:
    """Renderer of one model, seen from its viewpoints."""

    def __init__(self, setup: Setup) -> None:
        model = mujoco.MjModel.from_binary_path(_MODEL, {_MODEL: setup.model})
        # Without these a picture takes a processor 3 ms instead of 65.
        model.vis.quality.offsamples = 0
        model.vis.quality.shadowsize = 0
        model.vis.global_.offwidth, model.vis.global_.offheight = setup.width, setup.height
        self._model, self._data = model, mujoco.MjData(model)
        self._viewpoints = setup.viewpoints
        self._renderer = mujoco.Renderer(model, setup.height, setup.width, max_geom=model.ngeom + _BESIDE_GEOMS)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._renderer.scene.flags[flag] = 0

    def picture(self, view: ViewName, positions: bytes, mocap_poses: bytes = b"") -> npt.NDArray[np.uint8]:
        """Return a picture, RGB (height, width, 3), of the state with qpos `positions`; ValueError for a bad length."""
        model, data = self._model, self._data
        data.qpos[:] = np.frombuffer(positions)
        mocap = np.frombuffer(mocap_poses).reshape(-1, 7)
        data.mocap_pos[:], data.mocap_quat[:] = mocap[:, :3], mocap[:, 3:]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        mujoco.mj_flex(model, data)
        mujoco.mj_tendon(model, data)
        viewpoint = self._viewpoints[view]
        if viewpoint.camera is None:
            self._renderer.update_scene(data)
            self._look_from(viewpoint)
        else:
            self._renderer.update_scene(data, camera=viewpoint.camera)
        picture: npt.NDArray[np.uint8] = self._renderer.render()
        return picture

    def close(self) -> None:
        """Free the graphics resources."""
        self._renderer.close()

    def _look_from(self, viewpoint: Viewpoint) -> None:
        position_m, forward, up = placed(viewpoint, self._data)
        for camera in self._renderer.scene.camera:
            camera.pos, camera.forward, camera.up = position_m, forward, up
            top = camera.frustum_near * np.tan(np.radians(0.5 * viewpoint.fovy_deg))
            camera.frustum_bottom, camera.frustum_top = -top, top
            # A width of 0 takes the picture's aspect ratio.
            camera.frustum_center = camera.frustum_width = 0.0


def placed(viewpoint: Viewpoint, data: mujoco.MjData) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, forward and up of a viewpoint that is no camera of the model: (3,) each, in the world frame."""
    rotation = data.xmat[viewpoint.body].reshape(3, 3)
    position_m: FloatArray = data.xpos[viewpoint.body] + rotation @ viewpoint.position_m
    return position_m, rotation @ viewpoint.forward, rotation @ viewpoint.up
