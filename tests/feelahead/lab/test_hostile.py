"""`try hostile`: a small run, and what memory's growth means."""

import csv
from pathlib import Path

import pytest

from feelahead.lab.questions.hostile import QUESTION, growth_mb
from feelahead.lab.sweep import ask
from feelahead.lab.table import Table


@pytest.mark.processes
def test_a_small_run_leaves_both_sides_alive(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rows.csv"
    small = ["--count", "400", "--rate", "0", "--stretches", "1", "--quiet", "0.5", "--csv", str(path)]
    assert ask(QUESTION, small) == 0
    assert "tick p99 under attack by quiet" in capsys.readouterr().out
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["phase"] for row in rows] == ["quiet", "hostile", "quiet", "end"]
    assert rows[-1]["sent"] == "400"
    assert int(rows[-1]["motion_received"]) > 0


def test_growth_counts_to_the_stretch_in_which_it_happens() -> None:
    rows = [("quiet", 100.0), ("hostile", 103.0), ("quiet", 104.0), ("hostile", 104.5), ("quiet", 104.0)]
    table = Table([*({"phase": phase, "memory_mb": value} for phase, value in rows), {"phase": "end"}])
    assert growth_mb(table, "hostile") == pytest.approx(3.5)
    assert growth_mb(table, "quiet") == pytest.approx(0.5)
