"""The scenes in tests/data, which never change, are as their comments say: objects, distances and motion."""

import re

import numpy as np
import pytest

from common.roles import Role
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.drivers.mujoco.true_contact import TrueContact
from tests.helpers.repository import DATA

SCENES = {
    **dict.fromkeys(("wall", "wall_45", "wall_beside"), "wall"),
    **dict.fromkeys(("rod_2mm", "rod_5mm", "rod_10mm"), "rod"),
    **dict.fromkeys(("table_1_box", "table_2_boxes", "table_12_tetrahedra", "table_mesh"), "bench"),
    **dict.fromkeys(("moving", "fleeing"), "mover"),
    **dict.fromkeys(("terrain", "terrain_ahead"), "terrain"),
    **{name: name for name in ("plate", "ball", "post", "mug")},
    **{"slot": "left_post right_post wall", "shelf_edge": "shelf", "place_held": "table target", "u_mesh": "u"},
    **{"empty": "box", "edge": "left_block right_block", "turn": "left_post right_post"},
    "cluttered": "left_box left_ball right_box right_tetrahedron board_above box_below ball_below box_behind",
}
"""Names of the objects in each scene"""
DOWN = {"place_held", "u_mesh", "mug"}
"""Scenes in which the tool points downwards"""
every_scene = pytest.mark.parametrize("name", SCENES)


def load(name: str) -> Scene:
    return load_scene(DATA / f"{name}.xml", "tool")


def test_each_file_is_looked_at() -> None:
    assert {path.stem for path in DATA.glob("*.xml")} == {"arm", *SCENES}


@every_scene
def test_it_is_loaded_as_meant_and_stands_free(name: str) -> None:
    scene = load(name)
    roles = {"table": Role.SUPPORT, "target": Role.TARGET}
    assert scene.roles == {thing: roles.get(thing, Role.OBSTACLE) for thing in SCENES[name].split()}
    assert scene.start_pose == "the keyframe 'home'"
    assert (scene.primitives.volume_errors, scene.shared_names, scene.warnings) == ({}, (), ())
    assert scene.data.ncon == 0
    np.testing.assert_array_equal(scene.data.qpos[scene.robot.finger_positions], [0.0425, 0.0425])
    # Fingers close along y; one home for all that move ahead and one for all that move down.
    axes = scene.data.site_xmat[scene.robot.site].reshape(3, 3)
    home, ahead = ([0.45, 0.0, 0.48], [0, 0, -1]) if name in DOWN else ([0.55, 0.0, 0.2], [1, 0, 0])
    np.testing.assert_allclose(scene.data.site_xpos[scene.robot.site], home, atol=1e-5)
    np.testing.assert_allclose(axes[:, 2], ahead, atol=1e-4)
    np.testing.assert_allclose(axes[:, 0], [0, -1, 0], atol=1e-4)


@every_scene
def test_the_free_way_is_what_its_comment_says(name: str) -> None:
    scene = load(name)
    truth = TrueContact(scene)
    held = next((thing for thing, role in scene.roles.items() if role is Role.TARGET), None)
    way_m = truth.way_left_m(truth.approach()[0], held, farthest_m=0.45)
    comment = (DATA / f"{name}.xml").read_text().split("-->")[0]
    assert re.findall(r"Free way: (\w+)", comment) == [f"{1e3 * way_m:.0f}" if way_m < 0.45 else "endless"]
