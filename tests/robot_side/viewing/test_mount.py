"""Viewpoints of mounted cameras, against the pinhole itself."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from operator_side.viewing.console.outlines import seen
from robot_side.drivers.remote.picture_message import Intrinsics
from robot_side.settings import RobotSettings
from robot_side.surroundings.mount import Mount
from robot_side.viewing.mount import mounted_eye

WIDTH, HEIGHT = 320, 240


def test_the_page_draws_points_where_the_pinhole_shows_them() -> None:
    generator = np.random.default_rng(4)
    turned = Rotation.random(random_state=5)
    w, x, y, z = turned.as_quat(scalar_first=True).tolist()
    mount, pinhole = Mount((0.02, -0.05, 0.1), (w, x, y, z)), Intrinsics(300.0, 280.0, 170.0, 101.0)
    tool_turned = Rotation.random(random_state=6)
    tool = np.concatenate([[0.4, 0.1, 0.3], tool_turned.as_quat(scalar_first=True)])
    in_camera = generator.uniform((-0.2, -0.2, 0.3), (0.2, 0.2, 1.0), (20, 3))
    points = tool_turned.apply(turned.apply(in_camera) + mount.position_m) + tool[:3]
    places = seen(points, tool, mounted_eye(mount, pinhole, WIDTH, HEIGHT))
    assert places is not None
    columns = pinhole.cx + pinhole.fx * in_camera[:, 0] / in_camera[:, 2]
    rows = pinhole.cy + pinhole.fy * in_camera[:, 1] / in_camera[:, 2]
    assert 0.5 * WIDTH + 0.5 * HEIGHT * places[:, 0] == pytest.approx(columns)
    assert 0.5 * HEIGHT - 0.5 * HEIGHT * places[:, 1] == pytest.approx(rows)


def settings(tmp_path: Path, text: str) -> RobotSettings:
    file = tmp_path / "robot.toml"
    file.write_text(text)
    return parse_settings(RobotSettings, "feelahead-robot", ["--config", str(file)])


def test_mounts_are_set_in_a_file_for_each_view(tmp_path: Path) -> None:
    mount = settings(
        tmp_path, "[cameras.mount.overview]\nposition_m = [0.5, 0.0, 1.5]\nquaternion = [0.0, 1.0, 0.0, 0.0]\n"
    ).cameras.mount
    assert mount.overview == Mount((0.5, 0.0, 1.5), (0.0, 1.0, 0.0, 0.0))
    assert mount.first_person is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("position_m = [0.5, 0.0, 1.5]\nquaternion = [1.0, 1.0, 0.0, 0.0]", "quaternion = .*; valid: .* of length 1"),
        ("position_m = [500.0, 0.0, 1.5]\nquaternion = [1.0, 0.0, 0.0, 0.0]", "position_m"),
        ("position_m = [0.0, 0.0, 1.5]", "quaternion"),
        ("position_m = [0.0, 0.0, 1.5]\nquaternion = [nan, 0.0, 0.0, 0.0]", "quaternion"),
    ],
)
def test_a_mount_that_cannot_be_is_an_error(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        settings(tmp_path, f"[cameras.mount.first_person]\n{text}\n")


def test_pictures_need_cameras() -> None:
    with pytest.raises(ConfigurationError, match="--pictures and --no-cameras exclude each other"):
        parse_settings(RobotSettings, "feelahead-robot", ["--pictures=tcp://127.0.0.1:0", "--no-cameras"])
