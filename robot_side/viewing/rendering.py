"""Off-screen rendering of a MuJoCo model; imported only if rendering works here (see `off_screen`)."""

import mujoco  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from common.protocol.view_messages import ViewName
from robot_side.drivers.mujoco.drawing.renderer import fast_renderer, look_from
from robot_side.drivers.mujoco.viewpoints import Viewpoint
from robot_side.viewing.exchange import Setup

_MODEL = "model.mjb"


class Renderer:
    """Renderer of one model, seen from its viewpoints."""

    def __init__(self, setup: Setup) -> None:
        model = mujoco.MjModel.from_binary_path(_MODEL, {_MODEL: setup.model})
        self._model, self._data = model, mujoco.MjData(model)
        self._viewpoints = setup.viewpoints
        self._renderer = fast_renderer(model, setup.width, setup.height)

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
            look_from(self._renderer, *placed(viewpoint, data), viewpoint.fovy_deg)
        else:
            self._renderer.update_scene(data, camera=viewpoint.camera)
        picture: npt.NDArray[np.uint8] = self._renderer.render()
        return picture

    def close(self) -> None:
        """Free the graphics resources."""
        self._renderer.close()


def placed(viewpoint: Viewpoint, data: mujoco.MjData) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, forward and up of a viewpoint that is no camera of the model: (3,) each, in the world frame."""
    rotation = data.xmat[viewpoint.body].reshape(3, 3)
    position_m: FloatArray = data.xpos[viewpoint.body] + rotation @ viewpoint.position_m
    return position_m, rotation @ viewpoint.forward, rotation @ viewpoint.up
