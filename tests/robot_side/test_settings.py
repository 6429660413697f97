import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import pytest

from common.command.command_line import load_toml, parse_settings
from common.errors import ConfigurationError
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.assembly import build_robot_side
from robot_side.cameras.settings import CamerasSettings
from robot_side.enlargement.prediction_errors import PredictionErrors
from robot_side.objects.perceived import Role
from robot_side.settings import CameraSettings, EncoderSettings, RobotSettings
from robot_side.simulation.built_in_scenes import SceneName

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
    kind: Callable[..., Any], name: str, values: tuple[float, ...]
) -> None:
    for value in values:
        with pytest.raises(ValueError, match=name) as caught:
            kind(**{name: value})
        assert str(value) in str(caught.value)
        assert "valid" in str(caught.value)


@pytest.mark.parametrize(
    "mean_m", [(0.0, NAN, 0.0), (INFINITY, 0.0, 0.0), (0.0, 0.0, -INFINITY)], ids=["nan", "infinite", "minus infinite"]
)
def test_a_mean_that_is_not_finite_is_found_before_anything_starts(mean_m: tuple[float, float, float]) -> None:
    with pytest.raises(ConfigurationError, match="kinematic_mean_m"):
        RobotSettings(kinematic_mean_m=mean_m)
    with pytest.raises(ValueError, match="mean_m"):
        CameraSettings(mean_m=mean_m)


def test_the_cameras_mean_is_of_every_axis_or_of_each() -> None:
    assert CameraSettings(mean_m=-0.002).mean_vector_m == (-0.002, -0.002, -0.002)
    assert CameraSettings(mean_m=(0.001, 0.0, -0.003)).mean_vector_m == (0.001, 0.0, -0.003)
    with pytest.raises(ValueError, match=r"mean_m = 1\.1"):
        CameraSettings(mean_m=(0.0, 1.1, 0.0))


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        (EncoderSettings, {"sigma_rad": 0.0, "resolution_rad": 0.0}),
        (EncoderSettings, {"sigma_rad": 1.0, "resolution_rad": 1.0}),
        (CameraSettings, {"mean_m": -1.0, "sd_m": 0.0, "frame_sd_m": 1.0}),
        (RobotSettings, {"assumed_delay_s": 0.001, "cover_m": 0.0005, "probability": 1e-9}),
        (RobotSettings, {"assumed_delay_s": 60.0, "cover_m": 0.05, "probability": 1.0 - 1e-9}),
    ],
)
def test_the_ends_of_the_ranges_are_valid(kind: Callable[..., Any], values: dict[str, Any]) -> None:
    kept = kind(**values)
    assert {name: getattr(kept, name) for name in values} == values


def test_model_and_site_come_together() -> None:
    with pytest.raises(ValueError, match="--model is given without --site; valid: both, or neither"):
        build_robot_side(RobotSettings(model=Path("arm.xml")), 1, "")
    with pytest.raises(ValueError, match="--site is given without --model; valid: both, or neither"):
        build_robot_side(RobotSettings(site="tool"), 1, "")


@pytest.mark.parametrize("scene", get_args(SceneName))
def test_no_scene_is_asked_for_with_a_model_not_even_the_usual_one(tmp_path: Path, scene: str) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(f'scene = "{scene}"')
    with pytest.raises(ConfigurationError, match=f"--scene {scene} with --model: valid: one of them"):
        parse_settings(RobotSettings, "robot", ["--config", str(path), "--model", "arm.xml", "--site", "tool"])


def test_one_of_them_may_stand_in_the_file_and_the_other_on_the_command_line(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text('model = "arm.xml"')
    both = parse_settings(RobotSettings, "robot", ["--config", str(path), "--site", "tool"])
    assert (both.model, both.site) == (Path("arm.xml"), "tool")


def test_the_enlargement_knows_both_parts_of_the_cameras_error() -> None:
    prediction = PredictionErrors(arm="0123456789ab")
    known = RobotSettings(
        probability=0.9,
        camera=CameraSettings(mean_m=-0.002, sd_m=0.003, frame_sd_m=0.004),
        kinematic_mean_m=(0.001, 0.0, -0.001),
    ).uncertainty(prediction)
    assert known.probability == 0.9
    assert known.camera_mean_m == (-0.002, -0.002, -0.002)
    assert known.camera_sd_m == pytest.approx(0.005)
    assert known.kinematic_mean_m == (0.001, 0.0, -0.001)
    assert known.prediction is prediction


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
    assert settings.motion == RobotSettings().motion


def test_cameras_are_switched_off_by_a_flag_or_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text("[cameras]\non = false\nwidth = 320\nrate_hz = 15.0\n")
    from_file = parse_settings(RobotSettings, "robot", ["--config", str(path)]).cameras
    assert (from_file.on, from_file.width, from_file.height, from_file.rate_hz) == (False, 320, 480, 15.0)
    assert parse_settings(RobotSettings, "robot", ["--config", str(path), "--cameras"]).cameras.on
    assert not parse_settings(RobotSettings, "robot", ["--no-cameras"]).cameras.on
    assert parse_settings(RobotSettings, "robot", ["--cameras.quality", "50"]).cameras.quality == 50


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("[cameras]\nquality = 0", "quality = 0"),
        ('[roles]\npost = "enemy"', "enemy"),
        ("kinematic_mean_m = [0.0, 0.001]", "kinematic_mean_m"),
        ("[camera]\nmean_m = [0.0, 0.001]", "mean_m"),
        ("[camera]\nsd_m = nan", "sd_m = NaN"),
        ("[encoder]\nsigma_rad = 2.0", "sigma_rad = 2.0"),
        ("model = 3", "model"),
        ("cover_m = 0", "cover_m = 0"),
        ("cover_m = 'fine'", "cover_m"),
        ("law = 'alignment'", "law"),
        ("spheres = 16", "spheres"),
        ("[stiffness]\nreference = 'volume'", "stiffness"),
        ("[enlargement]\nmode = 'once'", "enlargement"),
        ("[motion]\nstick_speed_m_s = 9.0", "stick_speed_m_s = 9.0"),
        ("[safety]\ngap_s = 0", "gap_s = 0"),
    ],
)
def test_bad_keys_of_a_file_are_named_in_one_line(tmp_path: Path, content: str, named: str) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(content)
    with pytest.raises(ConfigurationError) as caught:
        load_toml(path, RobotSettings)
    text = str(caught.value)
    assert named in text
    assert "robot.toml" in text
    assert "\n" not in text
