import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from common.command.command_line import parse_settings
from common.roles import Role
from robot_side.depth.settings import MapSettings
from robot_side.operators.safety import SafetySettings
from robot_side.settings import CameraSettings, RobotSettings

NAN, INFINITY = math.nan, math.inf


@pytest.mark.parametrize(
    ("kind", "name", "values"),
    [
        (CameraSettings, "mean_m", (-1.1, 1.1, NAN, INFINITY)),
        (SafetySettings, "lease_s", (0.0, 0.1, 60.0, NAN)),
        (CameraSettings, "mean_m", ((0.0, 1.1, 0.0), (0.0, NAN, 0.0))),
        (RobotSettings, "kinematic_mean_m", ((0.0, NAN, 0.0), (INFINITY, 0.0, 0.0))),
        (RobotSettings, "probability", (0.0, 1.0, -0.1, 1.5, NAN)),
        (RobotSettings, "duration", (0.0, -1.0, NAN, INFINITY)),
        (RobotSettings, "seed", (-1,)),
    ],
)
def test_what_is_checked_by_hand_is_named_with_what_is_valid(
    kind: Callable[..., Any], name: str, values: tuple[Any, ...]
) -> None:
    for value in values:
        with pytest.raises(ValueError, match=name) as caught:
            kind(**{name: value})
        assert isinstance(value, tuple) or str(value) in str(caught.value)
        assert "valid" in str(caught.value)


def test_the_limits_are_those_of_the_contract() -> None:
    expected = SafetySettings(gap_s=0.1, age_s=0.1, jitter_s=0.08, max_delay_s=2.0, healthy_s=1.0, lease_s=0.9)
    assert SafetySettings() == expected


@pytest.mark.parametrize(
    ("arguments", "mean_m"),
    [
        (["--camera.mean-m", "0.01"], 0.01),
        (["--camera.mean-m=-0.01"], -0.01),
        (["--camera.mean-m", "0.01", "0.0", "0.02"], (0.01, 0.0, 0.02)),
    ],
)
def test_the_cameras_mean_is_one_number_or_three_on_the_command_line(
    arguments: list[str], mean_m: float | tuple[float, float, float]
) -> None:
    assert parse_settings(RobotSettings, "robot", arguments).camera.mean_m == mean_m


def test_a_file_sets_paths_roles_and_whole_numbers(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text('prediction_errors = "errors.toml"\n[roles]\npost = "ignored"\n[cameras]\nwidth = 320\n')
    settings = parse_settings(RobotSettings, "robot", ["--config", str(path)])
    assert settings.prediction_errors == Path("errors.toml")
    assert settings.roles == {"post": Role.IGNORED}
    assert (settings.cameras.width, settings.cameras.height) == (320, 480)


def test_sent_objects_may_stand_beside_what_depth_cameras_see_and_half_strength_needs_its_law() -> None:
    at = "tcp://127.0.0.1:0"
    assert RobotSettings(objects=at, depth=at).by_depth
    with pytest.raises(ValueError, match="--perception and --objects exclude each other"):
        RobotSettings(objects=at, perception="depth")
    half = MapSettings(unseen="half")
    assert RobotSettings(depth_map=half).depth_map.unseen == "half"
    with pytest.raises(ValueError, match=r"--depth-map\.unseen half and --law paper exclude each other"):
        RobotSettings(depth_map=half, law="paper")
