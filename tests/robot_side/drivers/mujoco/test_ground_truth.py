"""True minimum distance among many objects, compared with the distances of all single pairs."""

import itertools
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.roles import Role
from robot_side.drivers.mujoco.ground_truth import GroundTruth, geom_distance, least_distance
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import planar_arm


def crowded(folder: Path, floor: bool) -> Scene:
    generator = np.random.default_rng(3)
    balls = [
        f'<geom name="ball{k}" type="{"sphere" if k % 2 else "box"}" size="0.01 0.02 0.03" pos="{x} {y} {z}"/>'
        for k, (x, y, z) in enumerate(generator.uniform([0.3, -1.0, 0.3], [1.6, 1.0, 1.5], (400, 3)).round(4))
    ]
    plane = '<geom name="support" type="plane" size="2 2 0.1" pos="0 0 -0.1"/>' if floor else ""
    return load_scene(planar_arm(folder, world="".join(balls) + plane), "tcp")


@pytest.mark.parametrize("floor", [False, True])
def test_the_least_distance_is_that_of_the_nearest_pair(tmp_path: Path, floor: bool) -> None:
    scene = crowded(tmp_path, floor)
    mine = scene.robot.gripper_geoms.astype(np.int64)
    theirs = np.array([geom for thing in scene.objects for geom in thing.geoms], dtype=np.int64)
    assert len(theirs) == 400 + floor
    for farthest_m in (0.05, 0.3, 2.0):
        found = least_distance(scene.model, scene.data, mine, theirs, farthest_m)
        each = [
            geom_distance(scene.model, scene.data, int(one), int(other), farthest_m)
            for one, other in itertools.product(mine, theirs)
        ]
        assert found == pytest.approx(min(*each, farthest_m), abs=1e-12)


def test_what_is_near_follows_the_roles(tmp_path: Path) -> None:
    scene = crowded(tmp_path, floor=False)
    truth = GroundTruth(scene)
    every = truth.observe()
    assert every.min_obstacle_distance_m == every.min_distance_m
    assert every.target is None
    for thing in scene.objects:
        scene.roles[thing.name] = Role.SUPPORT
    assert truth.observe().min_distance_m is None
    scene.roles["ball0"] = Role.TARGET
    alone = truth.observe()
    assert alone.min_obstacle_distance_m is None
    assert alone.target is not None
    np.testing.assert_allclose(alone.target.position_m, np.zeros(3), atol=1e-12)


def test_a_world_that_moves_is_observed_anew_and_one_that_rests_is_not() -> None:
    scene = load_scene()
    truth, robot = GroundTruth(scene), scene.robot
    assert truth.observe() is truth.observe()
    for moved in (1e-3, 1e-3, -2e-3):
        scene.data.qpos[robot.arm_positions[0]] += moved
        mujoco.mj_forward(scene.model, scene.data)
        assert truth.observe().min_distance_m == GroundTruth(scene).observe().min_distance_m
    crept = truth.observe()
    for _ in range(20):
        scene.data.qpos[robot.arm_positions[0]] += 1e-7
    assert truth.observe() is not crept
