"""`feelahead bench cover`, with few points, from the command to its files."""

import csv
from pathlib import Path

import pytest

import feelahead.main
from common.errors import ConfigurationError
from tests.helpers.arm_models import planar_arm


def test_the_command_measures_the_cover_and_writes_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written, picture = tmp_path / "out.csv", tmp_path / "out.png"
    own = ["--model", str(planar_arm(tmp_path)), "--site", "tcp"]
    few = ["--points", "2000", "--looks", "2", "--csv", str(written), "--picture", str(picture)]
    assert feelahead.main.command(["bench", "cover", *own, *few]) == 0
    said = capsys.readouterr().out
    assert "79.0 of 85.0" in said
    assert "missed" not in said
    with written.open(newline="", encoding="utf-8") as file:
        found = {(row["solid"], row["quantity"]): float(row["value"]) for row in csv.DictReader(file)}
    for name in ("built-in", "arm"):
        assert found[name, "sticks out"] == 0.0
        assert 2.0 < found[name, "stands out"] <= 3.0
    assert found["built-in", "spheres"] == 246
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--site", "tcp"], "--site is given without --model"),
        (["--points", "0"], "--points 0"),
        (["--looks", "0"], "--looks 0"),
        (["--seed", "-1"], "--seed -1"),
        (["--picture", "out.xyz"], "out.xyz"),
    ],
)
def test_bad_input_is_named(arguments: list[str], named: str) -> None:
    with pytest.raises(ConfigurationError, match=named):
        feelahead.main.command(["bench", "cover", *arguments])
