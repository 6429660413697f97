"""Depth pictures of a small scene: `python -m tests.robot_side.drivers.mujoco.drawing.depth_pictures BACKEND FILE.npz`.

A process of its own, because MuJoCo fixes the backend when it is imported.
"""

import sys
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.roles import Role
from robot_side.depth.picture import CameraPose
from robot_side.drivers.mujoco.drawing.off_screen import choose

WIDTH, HEIGHT, FOVY_DEG = 160, 120, 60.0
FACE_M: Final = 0.6
"""Where the wall begins along x; the camera stands at the origin"""
SLANT_RAD: Final = 0.6
"""Angle from the tilted plane's normal to x, about y"""
BALL_M: Final = (-0.35, 0.12, -0.08)
RADIUS_M: Final = 0.03
WALL_LABEL, BALL_LABEL = 7, 255
SCENE: Final = f"""
<mujoco>
  <statistic extent="3"/>
  <worldbody>
    <geom name="wall" type="box" size="0.5 2 2" pos="{FACE_M + 0.5} 0 0"/>
    <geom name="ball" type="sphere" size="{RADIUS_M}" pos="{BALL_M[0]} {BALL_M[1]} {BALL_M[2]}"/>
    <geom name="slant" type="plane" size="5 5 1" pos="0 100 0" euler="0 {np.degrees(SLANT_RAD) - 90.0} 0"/>
    <site name="mark" type="sphere" size="0.05" pos="0.3 0 0"/>
  </worldbody>
</mujoco>
"""
AHEAD: Final = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Looks along x, with z upwards in the picture"""
TURNED: Final = CameraPose(
    np.array([-0.1, 0.05, 0.1]), Rotation.from_euler("ZYX", [2.75, 0.5, 0.25]).as_matrix() @ AHEAD
)
"""Somewhere before the ball, at no right angle to anything"""


def _write(path: str) -> None:
    import mujoco  # type: ignore[import-untyped]  # noqa: PLC0415  # after the choice of a backend

    from robot_side.drivers.mujoco.depth_cameras.rendered import DepthCamera  # noqa: PLC0415

    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = model.vis.map.znear, model.vis.quality.offsamples
    found: dict[str, Any] = {}
    labels = {model.geom("wall").id: WALL_LABEL, model.geom("ball").id: BALL_LABEL}
    ahead = CameraPose(np.zeros(3), AHEAD)
    with DepthCamera(model, WIDTH, HEIGHT, FOVY_DEG, labels=labels, roles={BALL_LABEL: Role.TARGET}) as camera:
        for name, pose in (("wall", ahead), ("ball", TURNED)):
            picture = camera.picture(data, pose, 3.5)
            assert picture.labels is not None
            found |= {f"{name}_m": picture.depth_m, f"{name}_labels": picture.labels}
        assert picture.roles == {BALL_LABEL: Role.TARGET}
        assert picture.taken_s == 3.5
        found["pinhole"] = np.array([picture.pinhole.fx, picture.pinhole.fy, picture.pinhole.cx, picture.pinhole.cy])
    with DepthCamera(model, WIDTH, HEIGHT, FOVY_DEG, far_m=0.5) as camera:
        found["near_m"] = camera.picture(data, ahead, 0.0).depth_m
    # Without the wall and the ball the tilted plane is left.
    model.geom_pos[:2] = -50.0
    model.geom("slant").pos[:] = (FACE_M, 0.0, 0.0)
    mujoco.mj_forward(model, data)
    with DepthCamera(model, WIDTH, HEIGHT, FOVY_DEG) as camera:
        picture = camera.picture(data, ahead, 0.0)
        assert picture.labels is None
        found["slant_m"] = picture.depth_m
    assert before == (model.vis.map.znear, model.vis.quality.offsamples)
    np.savez(path, **found)


if __name__ == "__main__":
    choose(sys.argv[1])
    _write(sys.argv[2])
