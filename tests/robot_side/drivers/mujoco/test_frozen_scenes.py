"""The scenes in tests/data, which never change, are as their comments say: objects, distances and motion."""

import copy
import re

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.roles import Role
from robot_side.drivers.mujoco.camera import MujocoCamera
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.repository import DATA
from tests.robot_side.drivers.mujoco.test_scene_meshes import overlap_of

FARTHEST_M = 0.45
TOUCHING_M = 1e-5
STEP_M = 1e-3


Hit = tuple[float, str, str]
"""First contact straight ahead: distance in mm, the part of the gripper (or held object), and the object hit"""
SCENES: dict[str, tuple[str, Hit | None]] = {
    "wall": ("wall", (320, "fingertip", "wall")),
    "plate": ("plate", (320, "fingertip", "plate")),
    "ball": ("ball", (320, "right_fingertip", "ball")),
    "post": ("post", (320, "right_fingertip", "post")),
    "rod_2mm": ("rod", (320, "right_fingertip", "rod")),
    "rod_5mm": ("rod", (320, "right_fingertip", "rod")),
    "rod_10mm": ("rod", (320, "right_fingertip", "rod")),
    "wall_45": ("wall", (320, "right_fingertip", "wall")),
    "slot": ("left_post right_post wall", (320, "fingertip", "wall")),
    "shelf_edge": ("shelf", (320, "fingertip", "shelf")),
    "wall_beside": ("wall", None),
    "table_1_box": ("bench", None),
    "table_2_boxes": ("bench", None),
    "table_12_tetrahedra": ("bench", None),
    "table_mesh": ("bench", None),
    "place_held": ("table target", (320, "target", "table")),
    "u_mesh": ("u", (320, "fingertip", "u")),
    "mug": ("mug", (320, "palm", "mug")),
    "moving": ("mover", (400, "fingertip", "mover")),
    "cluttered": ("left_box left_ball right_box right_tetrahedron board_above box_below ball_below box_behind", None),
    "empty": ("box", None),
    "fleeing": ("mover", (120, "fingertip", "mover")),
    "edge": ("left_block right_block", None),
    "turn": ("left_post right_post", None),
    "terrain": ("terrain", None),
    "terrain_ahead": ("terrain", (320, "fingertip", "terrain")),
}
"""Names of the objects in each scene, and the first contact straight ahead; None if there is none"""
DOWN = {"place_held", "u_mesh", "mug"}
"""Scenes in which the tool points downwards"""
TABLES = [name for name in SCENES if name.startswith("table_")]
every_scene = pytest.mark.parametrize("name", SCENES)


def load(name: str) -> Scene:
    return load_scene(DATA / f"{name}.xml", "tool")


def part_name(scene: Scene, geom: int) -> str:
    """Return the object that a geom belongs to, or the name of the robot's geom."""
    return next((thing.name for thing in scene.objects if geom in thing.geoms), str(scene.model.geom(geom).name))


def approach(scene: Scene) -> FloatArray:
    axis: FloatArray = scene.data.site_xmat[scene.robot.site].reshape(3, 3)[:, 2].copy()
    return axis


def split_geoms(scene: Scene) -> tuple[list[int], list[int]]:
    """Return the geoms of the gripper and of targets, and the geoms of all other objects."""
    held = [geom for thing in scene.objects if scene.roles[thing.name] is Role.TARGET for geom in thing.geoms]
    others = [geom for thing in scene.objects for geom in thing.geoms if geom not in held]
    return [*scene.robot.gripper_geoms.tolist(), *held], others


def first_hit(scene: Scene) -> Hit | None:
    """Return the first contact of a gripper that moves straight ahead, found in steps and then by bisection."""
    data = copy.copy(scene.data)
    # MuJoCo's tree of a body's geoms was built for their original places.
    scene.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    moving, others = split_geoms(scene)
    start, axis = data.geom_xpos[moving].copy(), approach(scene)

    def touching(gone_m: float) -> list[tuple[int, int]]:
        data.geom_xpos[moving] = start + gone_m * axis
        mujoco.mj_collision(scene.model, data)
        pairs = [(int(pair[0]), int(pair[1])) for pair in data.contact.geom]
        ordered = [pair if pair[0] in moving else pair[::-1] for pair in pairs]
        return [(mine, other) for mine, other in ordered if mine in moving and other in others]

    steps_m = np.arange(0.0, FARTHEST_M, STEP_M)
    met_m = next((float(gone_m) for gone_m in steps_m if touching(gone_m)), None)
    if met_m is None:
        return None
    free_m = met_m - STEP_M
    while met_m - free_m > TOUCHING_M:
        middle_m = 0.5 * (free_m + met_m)
        free_m, met_m = (free_m, middle_m) if touching(middle_m) else (middle_m, met_m)
    mine, other = touching(met_m)[0]
    return 1e3 * met_m, part_name(scene, mine), part_name(scene, other)


def test_each_file_is_looked_at() -> None:
    assert {path.stem for path in DATA.glob("*.xml")} == {"arm", *SCENES}


@every_scene
def test_it_is_loaded_as_meant_and_stands_free(name: str) -> None:
    scene, (objects, _) = load(name), SCENES[name]
    roles = {"table": Role.SUPPORT, "target": Role.TARGET}
    assert scene.roles == {thing: roles.get(thing, Role.OBSTACLE) for thing in objects.split()}
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
    expected = SCENES[name][1]
    comment = (DATA / f"{name}.xml").read_text().removeprefix("<!-- ").split(" -->")[0]
    assert 2 <= len(comment.splitlines()) <= 4
    assert "Frozen: " in comment
    assert re.findall(r"Free way: (\w+)", comment) == ["endless" if expected is None else f"{expected[0]:.0f}"]
    found = first_hit(load(name))
    if expected is None or found is None:
        assert found is expected
        return
    assert found[0] == pytest.approx(expected[0], abs=0.1)
    assert found[1].endswith(expected[1])
    assert found[2] == expected[2]


def test_the_four_tables_are_perceived_as_one_solid() -> None:
    seen = {name: MujocoCamera(load(name)).perceive(0.0) for name in TABLES}
    kinds = {name: (len(it.box_object), len(it.tetrahedron_object), len(it.mesh_object)) for name, it in seen.items()}
    assert kinds == {
        "table_1_box": (1, 0, 0),
        "table_2_boxes": (2, 0, 0),
        "table_12_tetrahedra": (0, 12, 0),
        "table_mesh": (0, 0, 1),
    }
    # Around all of it: at the seam below the path, on an edge, at two corners; then anywhere near the top.
    centers = [[0.75, 0, 0.128], [0.75, 0, 0.15], [0.35, 0.1, 0.148], [0.35, 0.4, 0.148], [1.15, -0.4, 0.108]]
    random = np.random.default_rng(5)
    anywhere = random.uniform([0.3, -0.45, 0.08], [1.2, 0.45, 0.18], (100, 3))
    near = np.concatenate([centers[1:], anywhere])
    volumes = {
        name: np.concatenate([overlap_of(it, "bench", np.array(centers[:1]), 1.0), overlap_of(it, "bench", near, 0.05)])
        for name, it in seen.items()
    }
    expected = volumes["table_1_box"]
    assert expected[0] == pytest.approx(0.8 * 0.8 * 0.04, rel=1e-9)
    assert (expected > 0.0).sum() > 50
    for name in TABLES:
        # MuJoCo keeps vertices in single precision.
        np.testing.assert_allclose(volumes[name], expected, rtol=1e-6, atol=1e-10, err_msg=name)
