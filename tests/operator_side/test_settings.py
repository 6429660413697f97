"""The operator side's settings: from a file and from flags, and every refusal in one line."""

import math
from pathlib import Path

import pytest

from common.command.command_line import load_toml, parse_settings
from common.errors import ConfigurationError
from operator_side.feel.rendering import RenderingSettings
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel
from operator_side.people.settings import PersonSettings
from operator_side.settings import OperatorSettings

WITHIN_10 = ("visual_reaction_s", "touch_reaction_sd_s", "depth_error_sd_m", "grasp_depth_m", "lift_m", "carry_m")
REFUSED: dict[type, dict[str, tuple[float, ...]]] = {
    PersonSettings: {
        **dict.fromkeys(WITHIN_10, (-0.1, 10.0)),
        **dict.fromkeys(("trust", "noticeable_force"), (-0.1, 1.1)),
        "phase_margin_rad": (-0.1, math.pi / 2, 65.0),
        "attempts": (0, -1),
        "depth_error_mean_m": (-1.1, 1.1),
        "touch_reaction_s": (0.0, -0.1, 10.0),
        "pull_n": (-0.1, 20.1),
    },
    TriggerTravel: {"dead_zone": (-0.1, 0.98, 1.5), "saturation": (0.05, 0.0, 1.1)},
    StickRest: {"dead_zone": (-0.1, 1.0), "x": (-0.31, 0.31), "y": (-0.31, 0.31)},
    RenderingSettings: {"horizon_s": (-0.1, 2.1)},
    OperatorSettings: {"duration": (0.0, -2.0), "seed": (-1,), "console_port": (-1, 65536)},
}


@pytest.mark.parametrize(
    ("kind", "name", "values"), [(kind, name, values) for kind, by in REFUSED.items() for name, values in by.items()]
)
def test_every_value_out_of_range_is_named_with_what_is_valid(kind: type, name: str, values: tuple[float, ...]) -> None:
    for value in (*values, *(() if name in ("seed", "attempts", "console_port") else (math.nan, math.inf))):
        with pytest.raises(ValueError, match=rf"{name}\b.*{value}.*valid"):
            kind(**{name: value})


def test_the_ends_of_the_ranges_are_valid() -> None:
    PersonSettings(phase_margin_rad=0.0, attempts=1, trust=1.0, pull_n=20.0, **dict.fromkeys(WITHIN_10, 0.0))  # type: ignore[arg-type]
    TriggerTravel(dead_zone=0.0, saturation=1.0)
    StickRest(dead_zone=0.0)
    RenderingSettings(2.0)
    OperatorSettings(console_port=65535)


def test_a_file_sets_everything_and_flags_win(tmp_path: Path) -> None:
    usual = OperatorSettings()
    assert (usual.device, usual.connect, usual.compensation) == ("hid", "tcp://127.0.0.1:5555", "operator")
    path = tmp_path / "operator.toml"
    path.write_text('device = "simulated"\nhaptics = false\n[person]\nattempts = 5\nlift_m = 0.2\n')
    flags = ["--haptics", "--compensation=robot", "--person.attempts=2", "--calibration.l2.dead-zone=0.1"]
    settings = parse_settings(OperatorSettings, "operator", ["--config", str(path), *flags])
    assert (settings.device, settings.haptics, settings.compensation) == ("simulated", True, "robot")
    assert (settings.person.attempts, settings.person.lift_m) == (2, 0.2)
    assert settings.calibration == TravelCalibration(l2=TriggerTravel(dead_zone=0.1))


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ('device = "mouse"', "mouse"),
        ("[person]\nattempts = 0", "attempts = 0"),
        ("[person]\nvisual_reaction_ms = 250", "person.visual_reaction_ms"),
        ("[calibration.r2]\ndead_zone = 0.99", "dead_zone = 0.99"),
    ],
)
def test_bad_keys_of_a_file_are_named_in_one_line(tmp_path: Path, content: str, named: str) -> None:
    path = tmp_path / "operator.toml"
    path.write_text(content)
    with pytest.raises(ConfigurationError, match=rf"\A.*operator\.toml.*{named}.*\Z"):
        load_toml(path, OperatorSettings)


@pytest.mark.parametrize(("text", "seconds"), [("0ms", 0.0), ("12ms", 0.012), ("-12ms", -0.012), ("-2s", -2.0)])
def test_an_asymmetry_has_a_sign(text: str, seconds: float) -> None:
    assert OperatorSettings(asymmetry=text).asymmetry_s() == pytest.approx(seconds)
