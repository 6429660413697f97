import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from common.command.command_line import load_toml, parse_settings
from common.errors import ConfigurationError
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel
from operator_side.settings import OperatorSettings
from operator_side.simulated_person.settings import PersonSettings

NAN, INFINITY = math.nan, math.inf


@pytest.mark.parametrize(
    ("kind", "name", "values"),
    [
        (PersonSettings, "visual_reaction_s", (-0.1, 10.0, NAN, INFINITY)),
        (PersonSettings, "phase_margin_rad", (-0.1, math.pi / 2, 65.0, NAN, INFINITY)),
        (PersonSettings, "depth_error_sd_m", (-0.1, 10.0, NAN, INFINITY)),
        (PersonSettings, "grasp_depth_m", (-0.1, 10.0, NAN, INFINITY)),
        (PersonSettings, "lift_m", (-0.1, 10.0, NAN, INFINITY)),
        (PersonSettings, "attempts", (0, -1)),
        (PersonSettings, "carry_m", (-0.1, 10.0, NAN)),
        (PersonSettings, "depth_error_mean_m", (-1.1, 1.1, NAN)),
        (PersonSettings, "touch_reaction_s", (0.0, -0.1, 10.0, NAN)),
        (PersonSettings, "touch_reaction_sd_s", (-0.1, 10.0, NAN)),
        (PersonSettings, "trust", (-0.1, 1.1, NAN)),
        (PersonSettings, "pull_n", (-0.1, 20.1, NAN, INFINITY)),
        (PersonSettings, "noticeable_force", (-0.1, 1.1, NAN)),
        (TriggerTravel, "dead_zone", (-0.1, 0.98, 1.5, NAN)),
        (TriggerTravel, "saturation", (0.05, 0.0, 1.1, NAN)),
        (StickRest, "dead_zone", (-0.1, 1.0, NAN)),
        (StickRest, "x", (-0.31, 0.31, NAN)),
        (StickRest, "y", (-0.31, 0.31, NAN)),
        (OperatorSettings, "duration", (0.0, -2.0, NAN)),
        (OperatorSettings, "seed", (-1,)),
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


def test_the_ends_of_the_ranges_are_valid() -> None:
    PersonSettings(
        visual_reaction_s=0.0,
        phase_margin_rad=0.0,
        depth_error_sd_m=0.0,
        attempts=1,
        grasp_depth_m=0.0,
        lift_m=0.0,
    )
    TriggerTravel(dead_zone=0.0, saturation=1.0)
    StickRest(dead_zone=0.0)


def test_a_real_controller_and_the_robot_on_this_machine_are_what_one_gets() -> None:
    settings = OperatorSettings()
    assert settings.device == "hid"
    assert settings.connect == "tcp://127.0.0.1:5555"
    assert settings.haptics
    assert settings.compensation == "operator"


def test_a_file_sets_everything_and_flags_win(tmp_path: Path) -> None:
    path = tmp_path / "operator.toml"
    path.write_text('device = "simulated"\nhaptics = false\n[person]\nattempts = 5\nlift_m = 0.2\n')
    arguments = [
        "--config",
        str(path),
        "--haptics",
        "--compensation=robot",
        "--person.attempts",
        "2",
        "--calibration.l2.dead-zone",
        "0.1",
    ]
    settings = parse_settings(OperatorSettings, "operator", arguments)
    assert settings.device == "simulated"
    assert settings.haptics
    assert settings.compensation == "robot"
    assert (settings.person.attempts, settings.person.lift_m) == (2, 0.2)
    assert settings.calibration == TravelCalibration(l2=TriggerTravel(dead_zone=0.1))


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ('device = "mouse"', "mouse"),
        ("[person]\nattempts = 0", "attempts = 0"),
        ("[person]\nphase_margin_rad = 2.0", "phase_margin_rad = 2.0"),
        ("[person]\nvisual_reaction_ms = 250", "person.visual_reaction_ms"),
        ("[calibration.r2]\ndead_zone = 0.99", "dead_zone = 0.99"),
    ],
)
def test_bad_keys_of_a_file_are_named_in_one_line(tmp_path: Path, content: str, named: str) -> None:
    path = tmp_path / "operator.toml"
    path.write_text(content)
    with pytest.raises(ConfigurationError) as caught:
        load_toml(path, OperatorSettings)
    text = str(caught.value)
    assert named in text
    assert "operator.toml" in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--person.grasp-depth-m", "-1"], "grasp_depth_m = -1"),
        (["--compensation", "nobody"], "nobody"),
        (["--person.lift-m", "tall"], "--person.lift-m"),
        (["--calibration.left-stick.dead-zone", "1"], "dead_zone = 1"),
        (["--device", "mouse"], "mouse"),
        (["--rendering.horizon-s", "3"], "horizon_s = 3"),
    ],
)
def test_bad_flags_are_named_in_one_line(arguments: list[str], named: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        parse_settings(OperatorSettings, "operator", arguments)
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "seconds"), [("0ms", 0.0), ("12ms", 0.012), ("-12ms", -0.012), ("-2s", -2.0)])
def test_an_asymmetry_has_a_sign(text: str, seconds: float) -> None:
    assert OperatorSettings(asymmetry=text).asymmetry_s() == pytest.approx(seconds)


def test_a_finger_that_pulls_r2_to_advance_has_the_usual_sides() -> None:
    with pytest.raises(ConfigurationError, match="--swap-sides with --person"):
        parse_settings(OperatorSettings, "operator", ["--swap-sides", "--person.pull-n", "3"])
