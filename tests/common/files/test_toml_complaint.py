from pathlib import Path

import pytest

from common.command.command_line import load_toml
from robot_side.settings import RobotSettings
from tests.helpers.refusal import refusal


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ('seed = "x"', 'seed = "x"; valid: a whole number'),
        ("seed = 1.5", "seed = 1.5; valid: a whole number"),
        ('duration = "long"', 'duration = "long"; valid: a number'),
        ("insecure = 1", "insecure = 1; valid: true or false"),
        ("bind = 5555", "bind = 5555; valid: a text"),
        ("model = 3", "model = 3; valid: a path, as a text"),
        ('link_model = "x"', 'link_model = "x"; valid: "datagram" or "stream"'),
        ("camera = 3", "camera = 3; valid: a table with frame_sd_m, mean_m, sd_m, unseen_m_s"),
        ('[camera]\nsd_m = "wide"', 'camera.sd_m = "wide"; valid: 0 to 1'),
        (
            "kinematic_mean_m = [1, 2]",
            "kinematic_mean_m = [1, 2]; valid: [a number, a number, a number]",
        ),
        ("seed = " + "[" * 3 + '"' + "a" * 500 + '"' + "]" * 3, "aaa...; valid: a whole number"),
        ('[roles]\ntin = "box"', 'valid: a table of NAME = "obstacle" or "target" or "support" or "ignored"'),
    ],
)
def test_the_line_names_a_way_out(tmp_path: Path, content: str, expected: str) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(content)
    text = refusal(load_toml, path, RobotSettings)
    assert text.startswith(f"--config {path}: ")
    assert text.endswith(expected)
