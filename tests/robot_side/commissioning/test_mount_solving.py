"""A depth camera's mount is solved from what it sees of the robot, or refused with the reason."""

import re
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.command.command_line import parse_settings
from robot_side.commissioning.depth_figures import Look, LookedAt
from robot_side.commissioning.mount_check import mount_check, mount_lines
from robot_side.commissioning.mount_solving import Refused, Solved, solve_mount
from robot_side.depth.camera_settings import LinkMount
from robot_side.depth.picture import CameraPose, DepthPicture
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot, RobotParts
from robot_side.settings import RobotSettings
from tests.robot_side.depth.mounts import HEIGHT, PINHOLE, WIDTH, Desk
from tests.robot_side.depth.ray_cast import STEREO

ZERO = np.zeros(1)


@pytest.fixture(scope="module")
def desk() -> Desk:
    return Desk()


@pytest.mark.parametrize(("error_m", "error_deg"), [(0.005, 0.5), (0.02, 2.0), (0.04, 2.0)])
def test_a_wrong_mount_is_solved_within_what_is_said(desk: Desk, error_m: float, error_deg: float) -> None:
    looks, believed = desk.look(desk.poses(3, 1), error_m, np.radians(error_deg), 1)
    found = solve_mount(looks, desk.robot)
    assert isinstance(found, Solved)
    off_m, off_rad = desk.told(found, believed)
    worst_m, _, worst_rad, _ = found.worst()
    assert worst_m < 0.001
    assert np.linalg.norm(off_m) < 3.0 * worst_m
    assert off_rad < 3.0 * worst_rad < np.radians(1.0)
    assert found.after_m < 0.001
    assert found.before_m > found.after_m


def test_more_poses_make_it_surer(desk: Desk) -> None:
    one, five = (solve_mount(desk.look(desk.poses(5, 1)[:count], 0.01, 0.01)[0], desk.robot) for count in (1, 5))
    assert isinstance(one, Solved)
    assert isinstance(five, Solved)
    assert five.worst()[0] < 0.7 * one.worst()[0]


def test_a_flat_plate_does_not_say_where_a_camera_is_beside_it() -> None:
    plate = '<mujoco><worldbody><body><joint/><geom type="box" size="2 2 0.1"/></body></worldbody></mujoco>'
    robot = PosedRobot(mujoco.MjModel.from_xml_string(plate), RobotParts(1, np.array([0]), np.array([], int), 0), ZERO)
    depth_m = np.full((HEIGHT, WIDTH), 0.5, np.float32)
    pose = CameraPose(np.array([0.0, 0.0, 0.61]), np.diag([1.0, -1.0, -1.0]))
    found = solve_mount([Look(DepthPicture(0.0, depth_m, PINHOLE), pose, ZERO, ZERO[:0], STEREO)], robot)
    assert isinstance(found, Refused)
    assert re.fullmatch(
        r"not determined: \d\d+ mm (right|down) in the picture and .*along the view; valid: .*", found.why
    )


@pytest.mark.parametrize(("error_m", "seed"), [(0.15, 0), (0.15, 1), (0.3, 0)])
def test_a_guess_that_is_too_far_is_refused(desk: Desk, error_m: float, seed: int) -> None:
    looks, _ = desk.look(desk.poses(3, seed), error_m, np.radians(15.0), seed)
    assert isinstance(solve_mount(looks, desk.robot), Refused)


def test_a_camera_on_the_gripper_that_is_too_near_is_refused() -> None:
    wrist = Desk("wrist")
    looks, mount = wrist.look(wrist.poses(3, 1), 0.005, 0.01)
    check, lines = mount_check("wrist", looks, mount, wrist.robot, arm_known=True)
    assert (check.good, lines) == (False, None)
    assert "points are on the robot's surface" in check.said
    assert "within 40 mm and 2°" in str(check.remedy)


def test_the_lines_are_those_of_a_config_file(tmp_path: Path) -> None:
    mount, file = LinkMount((0.1, -0.2, 0.3), (0.5, -0.5, 0.5, 0.5), "hand"), tmp_path / "cameras.toml"
    file.write_text(mount_lines("left.eye", mount))
    assert parse_settings(RobotSettings, "robot", ["--config", str(file)]).depth_mounts == {"left.eye": mount}


def test_one_picture_is_kept_of_each_pose_in_which_the_arm_stands(desk: Desk) -> None:
    looked, nothing = LookedAt(), np.zeros((HEIGHT, WIDTH), np.float32)
    desk.robot.pose(desk.poses(1, 0)[0], np.zeros(2))
    for number in range(40):
        # It stands for a second, moves for half a second, and stands again.
        now_s, arm = 0.1 * number, np.full(6, 0.1 * min(max(number - 10, 0), 5))
        looked.stand(now_s, arm, np.zeros(2))
        pose = CameraPose(np.zeros(3), np.eye(3))
        looked.see(DepthPicture(now_s - 0.05, nothing, PINHOLE), pose, desk.robot.body(), STEREO, 0)
    assert [look.arm[0] for look in looked.looks[0]] == pytest.approx([0.0, 0.5])
