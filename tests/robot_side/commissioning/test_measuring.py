"""`feelahead-robot --measure-limits` as a command, with a simulated arm of two joints."""

import tomllib
from pathlib import Path

import pytest

from robot_side.main import command
from tests.helpers.arm_models import planar_arm


@pytest.mark.long
@pytest.mark.parametrize("given", [["--measure-limits"], ["--measure-limits", "yes"]])
def test_a_simulated_arm_is_measured_without_a_question(
    given: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, config = planar_arm(tmp_path), tmp_path / "arm.toml"
    config.write_text("[simulated_limits]\nvelocity_rad_s = 0.3\n[arm.limits]\nacceleration_rad_s2 = 8.0\n")
    code = command([*given, "--config", str(config), "--model", str(model), "--site", "tcp"])
    said = capsys.readouterr().out
    assert code == 0
    lines = said[said.index("[arm.limits]") :]
    assert tomllib.loads(lines)["arm"]["limits"]["velocity_rad_s"] == pytest.approx([0.3, 0.3], rel=0.02)
    assert "the settings" in said
    assert "type yes" not in said
