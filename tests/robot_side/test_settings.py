import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from common.command.command_line import load_toml, parse_settings
from common.errors import ConfigurationError
from common.roles import Role
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.joint_reference import MotionLimits
from robot_side.operators.safety import SafetySettings
from robot_side.parts import build_parts
from robot_side.settings import CameraSettings, EncoderSettings, RobotSettings
from robot_side.viewing.settings import CamerasSettings

NAN, INFINITY = math.nan, math.inf


@pytest.mark.parametrize(
    ("kind", "name", "values"),
    [
        (EncoderSettings, "sigma_rad", (-1e-6, 1.1, NAN, INFINITY)),
        (EncoderSettings, "resolution_rad", (-1e-6, 1.1, NAN, -INFINITY)),
        (CameraSettings, "mean_m", (-1.1, 1.1, NAN, INFINITY)),
        (CameraSettings, "sd_m", (-1e-6, 1.1, NAN, INFINITY)),
        (CameraSettings, "frame_sd_m", (-1e-6, 1.1, NAN, INFINITY)),
        *[
            (ToolMotionSettings, name, (0.0, -0.1, 5.1, NAN, INFINITY))
            for name in ("trigger_speed_m_s", "stick_speed_m_s", "turn_speed_rad_s")
        ],
        *[(MotionLimits, name, (0.0, NAN, INFINITY)) for name in ("velocity_rad_s", "windup_rad")],
        *[(SafetySettings, name, (0.0, -1.0, 60.0, NAN, INFINITY)) for name in ("gap_s", "age_s", "max_delay_s")],
        *[(SafetySettings, name, (-1.0, 60.0, NAN, INFINITY)) for name in ("jitter_s", "healthy_s")],
        (SafetySettings, "lease_s", (0.0, 0.1, 60.0, NAN)),
        (CameraSettings, "mean_m", ((0.0, 1.1, 0.0), (0.0, NAN, 0.0))),
        (RobotSettings, "kinematic_mean_m", ((0.0, NAN, 0.0), (INFINITY, 0.0, 0.0))),
        (CamerasSettings, "width", (15, 4097)),
        (CamerasSettings, "quality", (0, 101)),
        (CamerasSettings, "rate_hz", (0.0, 121.0, NAN)),
        (RobotSettings, "assumed_delay_s", (0.0, -1.0, 60.1, NAN, INFINITY)),
        (RobotSettings, "cover_m", (0.0, 4e-4, 0.051, NAN, INFINITY)),
        (RobotSettings, "probability", (0.0, 1.0, -0.1, 1.5, NAN)),
        (RobotSettings, "duration", (0.0, -1.0, NAN, INFINITY)),
        (RobotSettings, "seed", (-1,)),
    ],
)
def test_every_value_out_of_range_is_named_with_what_is_valid(
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


def test_model_and_site_come_together() -> None:
    with pytest.raises(ValueError, match="--model is given without --site; valid: both, or neither"):
        build_parts(RobotSettings(model=Path("arm.xml")), 1, "")
    with pytest.raises(ValueError, match="--site is given without --model; valid: both, or neither"):
        build_parts(RobotSettings(site="tool"), 1, "")
    with pytest.raises(ValueError, match="--scene wall with --model: valid: one of them"):
        RobotSettings(model=Path("arm.xml"), site="tool", scene="wall")


ROBOT_TOML = """
probability = 0.95
cover_m = 0.005
law = "paper"
kinematic_mean_m = [0.0, 0.001, 0.0]
prediction_errors = "errors.toml"
model = "arms/arm.xml"
site = "tool"
[roles]
post = "ignored"
box = "target"
[camera]
sd_m = 0.001
mean_m = [0.001, 0.0, 0.002]
[safety]
gap_s = 0.2
[cameras]
on = false
width = 320
"""


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


def test_a_file_sets_everything_and_flags_win(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(ROBOT_TOML)
    settings = parse_settings(RobotSettings, "robot", ["--config", str(path), "--cover-m", "0.01", "--law", "swept"])
    assert settings.probability == 0.95
    assert (settings.cover_m, settings.law) == (0.01, "swept")
    assert settings.prediction_errors == Path("errors.toml")
    assert (settings.model, settings.site) == (Path("arms/arm.xml"), "tool")
    assert settings.roles == {"post": Role.IGNORED, "box": Role.TARGET}
    assert settings.camera == CameraSettings(mean_m=(0.001, 0.0, 0.002), sd_m=0.001)
    assert settings.kinematic_mean_m == (0.0, 0.001, 0.0)
    assert settings.safety.gap_s == 0.2
    assert (settings.cameras.on, settings.cameras.width, settings.cameras.height) == (False, 320, 480)
    assert settings.motion == RobotSettings().motion
    assert parse_settings(RobotSettings, "robot", ["--config", str(path), "--cameras"]).cameras.on


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ('[roles]\npost = "enemy"', "enemy"),
        ("[camera]\nmean_m = [0.0, 0.001]", "mean_m"),
        ("[camera]\nsd_m = nan", "sd_m = NaN"),
        ("model = 3", "model"),
        ("law = 'alignment'", "law"),
        ("spheres = 16", "spheres"),
        ("[safety]\ngap_s = 0", "gap_s = 0"),
    ],
)
def test_bad_keys_of_a_file_are_named_in_one_line(tmp_path: Path, content: str, named: str) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(content)
    with pytest.raises(ConfigurationError, match=rf"^[^\n]*robot\.toml[^\n]*{named}[^\n]*$"):
        load_toml(path, RobotSettings)
