"""Coarse spheres around the arm's links, which contain the links' geoms in every pose."""

from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import BoolArray, FloatArray
from robot_side.arm.port import ArmState
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.scene import load_scene
from tests.helpers.arm_models import planar_arm

BOXES = '<geom name="box" type="box" pos="0.1 0 0.05" euler="20 30 0" size="0.02 0.08 0.03"/><geom size="0.01 1" {}/>'


def inside(kind: int, size_m: FloatArray, points_m: FloatArray) -> BoolArray:
    if kind != GeomKind.CAPSULE:
        return np.ones(len(points_m), dtype=bool)
    points_m[:, 2] -= np.clip(points_m[:, 2], -size_m[1], size_m[1])
    return np.asarray(np.linalg.norm(points_m, axis=1) <= size_m[0])


@pytest.mark.parametrize("built_in", [True, False])
def test_they_contain_the_links_wherever_these_are(built_in: bool, tmp_path: Path) -> None:
    wrist = BOXES.format('type="capsule"')
    scene = load_scene() if built_in else load_scene(planar_arm(tmp_path, wrist=wrist), "tcp")
    model, robot, generator = scene.model, scene.robot, np.random.default_rng(1)
    kinematics, data = MujocoKinematics(scene), mujoco.MjData(model)
    readings = generator.uniform(-1.0, 1.0, robot.arm_joints.size)
    data.qpos[:] = scene.data.qpos
    data.qpos[robot.arm_positions] = readings
    mujoco.mj_kinematics(model, data)
    fingers = data.qpos[robot.finger_positions].copy()
    state = ArmState(0.0, readings, 0.0 * readings, fingers, 0.0, gripper_holding=False)
    centers_m, radii_m = kinematics.link_spheres(state)
    links = model.body_rootid[model.geom_bodyid] == robot.root_body
    looked_at = 0
    for geom in np.setdiff1d(np.flatnonzero(links), robot.gripper_geoms):
        if model.body_weldid[model.geom_bodyid[geom]] == 0:
            continue  # the base
        half_m = model.geom_aabb[geom, 3:]
        points_m = generator.uniform(-1.0, 1.0, (2000, 3)) * half_m
        points_m = points_m[inside(model.geom_type[geom], model.geom_size[geom], points_m.copy())]
        points_m = data.geom_xpos[geom] + points_m @ data.geom_xmat[geom].reshape(3, 3).T
        apart_m = np.linalg.norm(points_m[:, None] - centers_m, axis=2) - radii_m
        assert apart_m.min(axis=1).max() <= 1e-9
        looked_at += 1
    assert looked_at == (8 if built_in else 4)
