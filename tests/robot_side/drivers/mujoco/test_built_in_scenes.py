"""Places and sizes in the built-in scenes, drawn by the seed, stay within the ranges that docs/scenes.md states."""

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from common.roles import Role
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import COUPLING, planar_arm

SEEDS = range(12)
NAMES: tuple[SceneName, ...] = get_args(SceneName)

MOVED = ("target", "carton", "tin", "orange", "ball")
HOME = f'{COUPLING}<keyframe><key name="home" qpos="0.4 -1 0 0"/></keyframe>'


def box(scene: Scene, name: str) -> tuple[Any, Any]:
    geom = next(thing for thing in scene.objects if thing.name == name).geoms[0]
    return scene.data.geom_xpos[geom], scene.model.geom_size[geom]


@pytest.mark.parametrize("name", NAMES)
def test_a_scene_has_one_target_that_stands_and_nothing_touches_the_gripper(name: SceneName) -> None:
    for seed in SEEDS if name != "table" else (0,):
        scene = load_scene(name=name, seed=seed)
        assert list(scene.roles.values()).count(Role.TARGET) == 1
        truth = GroundTruth(scene).observe()
        assert truth.contacts == frozenset()
        assert truth.target is not None
        assert truth.target.support_gap_m == pytest.approx(0.0, abs=1e-6)
        assert truth.min_obstacle_distance_m is not None
        assert truth.min_obstacle_distance_m > 0.03


@pytest.mark.parametrize("name", ["wall", "slot", "shelf"])
def test_the_seed_says_where_things_stand(name: SceneName) -> None:
    places = [load_scene(name=name, seed=seed).data.geom_xpos.tolist() for seed in (0, 0, 1)]
    assert places[0] == places[1] != places[2]


def test_what_is_drawn_stays_within_what_is_said_of_it() -> None:
    behind_m = []
    for seed in SEEDS:
        scene = load_scene(name="wall", seed=seed)
        (wall, wall_half), (target, _) = box(scene, "wall"), box(scene, "target")
        # The target's centre is 20 mm beyond the tool's point, which the tips pass by 15 mm.
        behind_m.append(wall[0] - wall_half[0] - (target[0] + 0.020 + 0.015))

        scene = load_scene(name="slot", seed=seed)
        parts, (target, _) = scene.robot.gripper_geoms, box(scene, "target")
        half_m = max(abs(scene.data.geom_xpos[part][1]) + scene.model.geom_size[part][1] for part in parts)
        for name, side in (("left_post", 1.0), ("right_post", -1.0)):
            post, post_half = box(scene, name)
            assert 0.014 <= side * (post[1] - target[1]) - post_half[1] - half_m <= 0.041

        scene = load_scene(name="shelf", seed=seed)
        (edge, edge_half), (target, _) = box(scene, "edge"), box(scene, "target")
        board, board_half = box(scene, "support_shelf")
        assert 0.008 <= target[2] - 0.032 - (edge[2] + edge_half[2]) <= 0.025
        assert 0.030 <= board[2] + board_half[2] <= 0.090
        assert edge[2] + edge_half[2] > board[2] + board_half[2]
    assert 0.010 <= min(behind_m) < max(behind_m) - 0.02 <= 0.040


def test_a_wide_hand_gets_as_much_room_as_the_built_in_one(tmp_path: Path) -> None:
    places = {}
    for half_width_m in (0.06, 0.12):
        model = planar_arm(tmp_path, extra_bottom=HOME)
        model.write_text(model.read_text().replace('size="0.02 0.06 0.02"', f'size="0.02 {half_width_m} 0.02"'))
        data = load_scene(model, "tcp").data
        places[half_width_m] = {name: data.body(f"table_scene/{name}").xpos[:2].copy() for name in MOVED}
    moved = {name: places[0.12][name] - places[0.06][name] for name in MOVED}
    for name, sideways_m in {"target": 0.0, "carton": 0.0, "tin": 0.06, "orange": 0.06, "ball": -0.06}.items():
        np.testing.assert_allclose(moved[name], [0.0, sideways_m], atol=1e-9)
    assert float(load_scene().data.body("table_scene/tin").xpos[1]) == pytest.approx(0.14, abs=1e-5)
