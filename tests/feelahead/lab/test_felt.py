"""The compiled law agrees with its definition, and `feelahead bench felt` measures what its help says."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import feelahead.main
from feelahead.lab import cover
from feelahead.lab.approaches.ticks import DEMO
from feelahead.lab.cover import STANDS_OUT, Gripper
from feelahead.lab.questions.felt import QUESTION, Looked, run
from feelahead.lab.sweep import ask
from robot_side.drivers.mujoco.hand.gripper_cover import GripperCover, cover_gripper
from tests.helpers.arm_models import planar_arm


@pytest.mark.long
def test_onset_distances_are_a_table_goals_and_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written = tmp_path / "out.csv"
    few = replace(QUESTION, cells=lambda _: [Looked(DEMO, 3.0, 60), Looked("mug", 2.0, 40)])
    assert ask(few, ["--workers=1", f"--csv={written}"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "met onset distances later than 0.1 mm: 0" in shown
    assert "met onset distances of grazes out of their band: 0" in shown
    with written.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["scene"] for row in rows] == [DEMO, "mug"]
    assert all(int(row["distances"]) > 50 for row in rows)


def test_the_cover_of_a_gripper_is_a_row_for_each_part_and_a_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written, picture = tmp_path / "out.csv", tmp_path / "out.png"
    own = ["--model", str(planar_arm(tmp_path)), "--site", "tcp"]
    few = ["--points", "2000", "--csv", str(written), "--picture", str(picture)]
    assert feelahead.main.command(["bench", "felt", "--cover", *own, *few]) == 0
    assert "missed" not in capsys.readouterr().out
    with written.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["gripper"], row["part"], row["spheres"]) for row in rows[:3]] == [
        ("built-in", "gripper", "158"),
        ("built-in", "left_finger", "44"),
        ("built-in", "right_finger", "44"),
    ]
    assert [(row["gripper"], row["part"]) for row in rows[3:]] == [("arm", "hand"), ("arm", "left"), ("arm", "right")]
    for row in rows:
        assert float(row["sticks_out_mm"]) == 0.0
        median_mm, p99_mm, most_mm = (float(row[name]) for name in STANDS_OUT)
        assert 1.0 < median_mm < p99_mm < most_mm <= 3.0
        assert most_mm > 2.0
    assert [round(float(rows[0][name]), 1) for name in ("gap_mm", "gap_kept_mm")] == [85.0, 79.1]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_spheres_that_are_too_small_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Spheres with radii that are half a millimetre too small leave corners out, and protrude by so much less."""

    def smaller(*arguments: Any) -> GripperCover:
        found = cover_gripper(*arguments)
        return replace(found, radii_m=found.radii_m - 0.0005)

    monkeypatch.setattr(cover, "cover_gripper", smaller)
    for row in run(Gripper("built-in", None, None, 2000), 0):
        assert 0.1 < row["sticks_out_mm"] <= 0.5 + 1e-6
        assert 2.0 < row["stands_out_mm"] <= 2.5 + 1e-6
