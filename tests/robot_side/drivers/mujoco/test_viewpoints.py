from pathlib import Path

import numpy as np
import pytest

from common.protocol.view_messages import VIEW_NAMES, ViewName
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.drivers.mujoco.viewpoints import first_person_eye, overview_eye, viewpoints
from tests.helpers.arm_models import planar_arm
from tests.robot_side.viewing.picture_taking import HEIGHT, WIDTH, project

CAMERA = '<camera name="{}" pos="0.5 0 3" fovy="50"/>'


def test_the_models_own_cameras_come_first(tmp_path: Path) -> None:
    scene = load_scene(planar_arm(tmp_path, world=CAMERA.format("other") + CAMERA.format("overview")), "tcp")
    chosen = viewpoints(scene)["overview"].camera
    assert chosen is not None
    assert scene.model.camera(chosen).name == "overview"
    assert viewpoints(load_scene())["first_person"].camera == load_scene().model.camera("tool").id


@pytest.mark.parametrize("built_in", [True, False])
def test_the_overview_shows_tool_base_and_what_is_ahead(built_in: bool, tmp_path: Path) -> None:
    scene = load_scene() if built_in else load_scene(planar_arm(tmp_path, yaw_deg=70.0), "tcp")
    overview = viewpoints(scene)["overview"]
    tool = scene.data.site(scene.robot.site)
    ahead_m = tool.xpos + 0.2 * tool.xmat.reshape(3, 3)[:, 2] * [1.0, 1.0, 0.0]
    for point_m in (tool.xpos, ahead_m):
        row, column, depth_m = project(scene, overview, point_m)
        assert depth_m > 0.3
        assert 0.1 * HEIGHT < row < 0.9 * HEIGHT
        assert 0.1 * WIDTH < column < 0.9 * WIDTH
    # From above, with ahead upwards.
    assert project(scene, overview, ahead_m)[0] < project(scene, overview, tool.xpos)[0]
    assert overview.forward == (0.0, 0.0, -1.0)
    yaw = np.arctan2(*(tool.xpos - scene.data.xpos[scene.robot.root_body])[[1, 0]])
    assert overview.up == pytest.approx((np.cos(yaw), np.sin(yaw), 0.0))


def test_the_first_person_is_behind_the_palm_and_beside_it(tmp_path: Path) -> None:
    scene = load_scene(planar_arm(tmp_path), "tcp")
    view = viewpoints(scene)["first_person"]
    assert view.camera is None
    tool = scene.data.site(scene.robot.site)
    for along_m in (-0.02, 0.0, 0.3):
        row, column, depth_m = project(scene, view, tool.xpos + along_m * tool.xmat.reshape(3, 3)[:, 2])
        assert depth_m > 0.0
        assert 0 < row < HEIGHT
        assert column == pytest.approx(0.5 * WIDTH, abs=1.0)
    forward = scene.data.xmat[view.body].reshape(3, 3) @ view.forward
    assert forward @ tool.xmat.reshape(3, 3)[:, 2] > np.cos(np.radians(45.0))
    fingers = scene.data.geom_xpos[scene.robot.gripper_geoms[scene.robot.geom_on_finger]]
    for finger_m in fingers:
        row, column, _ = project(scene, view, finger_m)
        assert 0 < row < HEIGHT
        assert 0 < column < WIDTH


def test_the_first_person_starts_with_target_table_and_fingers_in_the_picture() -> None:
    scene = load_scene()
    view, data = viewpoints(scene)["first_person"], scene.data
    far_edge_m = np.add(data.body("table_scene/table").xpos, (1.1, 0.0, 0.0))
    fingers = data.geom_xpos[scene.robot.gripper_geoms[scene.robot.geom_on_finger]]
    things = (data.body("table_scene/target").xpos, data.site(scene.robot.site).xpos, *fingers)
    rows = []
    for point_m in (far_edge_m, *things):
        row, column, depth_m = project(scene, view, point_m)
        assert depth_m > 0.0
        assert 0 < column < WIDTH
        rows.append(row / HEIGHT)
    assert 0.25 < rows[0] < 0.5, "half of the picture is empty"
    assert max(rows) < 1.0


@pytest.mark.parametrize("view", VIEW_NAMES)
@pytest.mark.parametrize("built_in", [True, False])
def test_an_eye_sees_points_where_the_picture_has_them(built_in: bool, view: ViewName, tmp_path: Path) -> None:
    scene = load_scene() if built_in else load_scene(planar_arm(tmp_path, yaw_deg=70.0), "tcp")
    tool = scene.data.site(scene.robot.site)
    origin_m, axes, eye = tool.xpos, tool.xmat.reshape(3, 3), overview_eye(scene)
    if view == "overview":
        origin_m, axes = np.zeros(3), np.eye(3)
    else:
        eye = first_person_eye(scene)
    assert eye is not None
    for ahead_m in ((0.0, 0.0, 0.1), (0.03, -0.02, 0.3)):
        point_m = tool.xpos + tool.xmat.reshape(3, 3) @ ahead_m
        row, column, depth_m = project(scene, viewpoints(scene)[view], point_m)
        seen = axes.T @ (point_m - origin_m) - eye.position_m
        half_m = depth_m * np.tan(np.radians(0.5 * eye.fovy_deg))
        assert seen @ eye.forward == pytest.approx(depth_m)
        assert 0.5 * HEIGHT * (1.0 - seen @ eye.up / half_m) == pytest.approx(row)
        assert 0.5 * (WIDTH + HEIGHT * (seen @ np.cross(eye.forward, eye.up)) / half_m) == pytest.approx(column)


def test_a_moving_overview_has_no_eye(tmp_path: Path) -> None:
    still = planar_arm(tmp_path, world=CAMERA.format("overview"))
    assert overview_eye(load_scene(still, "tcp")) is not None
    moving = f'<body><joint type="hinge"/><geom size="0.01"/>{CAMERA.format("overview")}</body>'
    assert overview_eye(load_scene(planar_arm(tmp_path, world=moving), "tcp")) is None
