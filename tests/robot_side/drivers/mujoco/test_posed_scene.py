"""Distances of a gripper that is put at given poses among the objects, compared with distances computed by hand."""

import math

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.drivers.mujoco.camera import MujocoCamera
from robot_side.drivers.mujoco.posed_scene import PosedScene, ToolPath
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.drivers.mujoco.true_contact import TrueContact
from tests.helpers.repository import DATA

# By hand: the tool is at (0.55, 0, 0.2) with the fingertips 15 mm ahead, the wall's face at x = 0.885; the fingers'
# outer sides are 56.5 mm beside the tool when open, those of the palm 50 mm, and the wall beside begins at 81.5 mm.
WALL_M = 0.32
NOWHERE = np.zeros(3)


class Posed:
    """A scene of tests/data, and the joint positions of its keyframe."""

    def __init__(self, name: str) -> None:
        self.scene = load_scene(DATA / f"{name}.xml", "tool")
        self.posed = PosedScene(self.scene)
        robot, qpos = self.scene.robot, self.scene.data.qpos
        self.arm_rad: FloatArray = qpos[robot.arm_positions].copy()
        self.fingers: FloatArray = qpos[robot.finger_positions].copy()

    def at(self, *shift_m: float, fingers: FloatArray | None = None, turned_rad: float = 0.0) -> PosedScene:
        """Put the arm at the keyframe, changed, and all objects shifted by `shift_m`; return the posed scene.

        turned_rad: change of the first joint, which turns the whole arm about the vertical.
        """
        arm_rad = self.arm_rad + turned_rad * np.eye(6)[0]
        self.posed.set_pose(arm_rad, self.fingers if fingers is None else fingers, np.array(shift_m or NOWHERE))
        return self.posed


@pytest.fixture(scope="module")
def wall() -> Posed:
    return Posed("wall")


@pytest.fixture(scope="module")
def beside() -> Posed:
    return Posed("wall_beside")


def path(ahead_m: float, across_m: float = 0.0, turned_rad: float = 0.0) -> ToolPath:
    """Return a path of the tool from the home pose, in steps of 3 mm.

    The path is straight along x and y, or an arc about the vertical on which the tool turns by `turned_rad`.
    """
    share = np.linspace(0.0, 1.0, 1 + math.ceil(ahead_m / 0.003))[:, None]
    half = 0.5 * share * turned_rad
    moved_m = share * ahead_m * np.sinc(half / math.pi) * np.hstack([np.cos(half), np.sin(half), 0.0 * half])
    turns = Rotation.from_rotvec(share * [0.0, 0.0, turned_rad]).as_matrix()
    home = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    return ToolPath(np.array([0.55, 0.0, 0.2]) + moved_m + share * [0.0, across_m, 0.0], turns @ home)


@pytest.mark.parametrize(
    ("ahead_m", "margin_m", "clear"),
    [
        (0.0, 0.3199, True),
        (0.0, 0.3201, False),
        (0.31, 0.0099, True),
        (0.31, 0.0101, False),
        (0.3149, 0.005, True),
        (0.3151, 0.005, False),
        (0.4, 0.0, False),
    ],
)
def test_before_a_wall_it_stays_clear_up_to_the_margin(
    wall: Posed, ahead_m: float, margin_m: float, *, clear: bool
) -> None:
    assert wall.at().stays_clear(path(ahead_m), margin_m) is clear


def test_a_drift_towards_a_wall_beside_is_not_clear_and_one_away_is(beside: Posed) -> None:
    for across_m, clear in ((-0.02, True), (0.02, True), (0.026, False), (-0.026, True)):
        assert beside.at().stays_clear(path(0.35, across_m), 0.0) is clear
    # In the end it is as far off as along its own axis, except for the rotation about the path.
    assert not beside.at().stays_clear(path(0.35, 0.02), 0.006)


def test_a_turn_goes_along_an_arc(wall: Posed, beside: Posed) -> None:
    """The tool point always moves in the direction in which the tool points, here towards a wall beside it or away."""
    for turned, clear in ((0.4, False), (-0.4, True), (0.02, True)):
        assert beside.at().stays_clear(path(0.2, 0.0, turned), 0.0) is clear
    before = wall.at().gap_m()
    assert wall.at().stays_clear(path(0.3, 0.0, 0.3), 0.0)
    assert wall.posed.gap_m() == before


def test_a_turned_arm_is_where_kinematics_put_it(wall: Posed) -> None:
    set_pose = wall.at(turned_rad=0.2)
    np.testing.assert_allclose(set_pose.approach_axis(), [math.cos(0.2), math.sin(0.2), 0.0], atol=1e-4)
    # The foremost corner of the fingertips, 565 mm ahead of the base's axis and 54.5 mm beside it.
    corner_m = 0.565 * math.cos(0.2) + 0.0545 * math.sin(0.2)
    assert set_pose.gap_m() == pytest.approx(0.885 - corner_m, abs=1e-4)
    assert set_pose.contact_distance_m(1.0) == pytest.approx((0.885 - corner_m) / math.cos(0.2), abs=1e-4)
    np.testing.assert_allclose(wall.at().approach_axis(), [1.0, 0.0, 0.0], atol=1e-4)


@pytest.mark.parametrize("name", ["wall", "wall_45", "ball", "slot", "u_mesh", "mug", "cluttered"])
def test_at_home_it_is_what_the_live_scene_says(name: str) -> None:
    scene = Posed(name)
    truth, set_pose = TrueContact(scene.scene), scene.at()
    assert set_pose.gap_m() == pytest.approx(truth.gap_m(None), abs=1e-9)
    axis, _ = truth.approach()
    assert set_pose.contact_distance_m(0.5) == pytest.approx(truth.way_left_m(axis, None, 0.5), abs=1e-9)


@pytest.mark.parametrize("name", ["wall", "cluttered"])
def test_a_camera_is_off_by_its_errors_and_the_shift(name: str) -> None:
    scene = Posed(name)
    errors_m = 0.003 * np.random.default_rng(2).standard_normal((len(scene.scene.objects), 3))
    true, seen = MujocoCamera(scene.scene).perceive(0.0), scene.at(0.1, -0.2, 0.3).perceived(errors_m)
    assert seen.names == true.names
    off_m = errors_m[true.box_object] + [0.1, -0.2, 0.3]
    np.testing.assert_allclose(seen.box_centers_m, true.box_centers_m + off_m, atol=1e-12)


def test_where_things_may_sleep_they_are_moved_as_well() -> None:
    """If bodies may sleep, MuJoCo reads the positions of fixed geoms only once; posed objects must still move."""
    scene = load_scene(DATA / "wall.xml", "tool")
    scene.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    mujoco.mj_step(scene.model, scene.data)
    posed = PosedScene(scene)
    arm_rad, fingers = (scene.data.qpos[place] for place in (scene.robot.arm_positions, scene.robot.finger_positions))
    for shift_m in (0.0, 0.05, 0.05, -0.02):
        posed.set_pose(arm_rad, fingers, np.array([shift_m, 0.0, 0.0]))
        assert posed.gap_m() == pytest.approx(WALL_M + shift_m, abs=1e-4)
