"""The tables of docs/measurements.md come from stored figures, and the README's figures agree with them."""

import re
from pathlib import Path

import pytest

from feelahead.lab.measurements import ARMS, DOCUMENT, FIGURES, MARKED, TABLES, compared, read, written
from feelahead.lab.table import Table
from tests.helpers.repository import ROOT

README = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
TEXT = DOCUMENT.read_text(encoding="utf-8")


def test_every_table_stands_between_markers_and_below_the_command_that_make_figures_runs() -> None:
    assert not re.search(r"^\|", MARKED.sub("", TEXT), re.MULTILINE)
    assert [found["name"] for found in MARKED.finditer(TEXT)] == [*TABLES]
    asked = dict(re.findall(r"^figures/(\w+)\.csv: asks = (.+)$", (ROOT / "Makefile").read_text(), re.MULTILINE))
    above = re.findall(r"^    feelahead (.+)\n\n<!-- (\w+): by make figures -->$", TEXT, re.MULTILINE)
    assert {name: command for command, name in above} == asked


def test_the_tables_are_those_of_the_stored_figures() -> None:
    assert written(TEXT) == TEXT


def test_a_figure_copied_by_hand_does_not_last(tmp_path: Path) -> None:
    (tmp_path / "commit").write_text("0123abcd\n")
    (tmp_path / "cover.csv").write_text("part,spheres,sticks_out_mm,stands_out_mm\npalm,7,0.0,2.5\ntip,3,0.1,1.0\n")
    marked = "Before\n<!-- {}: by make figures -->\n| by hand | 99 |\n<!-- end -->\nAfter\n"
    once = written(marked.format("cover"), tmp_path)
    assert "99" not in once
    assert "Commit 0123abcd:\n\n| part |" in once
    assert "\n| all | 10 | 0.1 | 2.5 |\n<!-- end -->\nAfter\n" in once
    assert written(once, tmp_path) == once
    without_figures = marked.format("demo")
    assert written(without_figures, tmp_path) == without_figures


def test_intervals_of_haptics_resample_seeds_and_not_trials(tmp_path: Path) -> None:
    (tmp_path / "commit").write_text("0123abcd\n")
    rows = [
        {
            "scene": "wall",
            "delay_ms": delay_ms,
            "arm": arm,
            "seed": seed,
            "hits": int(arm == "off" and seed == 0),
            "fastest_hit_mm_s": 50.0 + delay_ms if arm == "off" and seed == 0 else None,
            "full_share": None if arm == "off" else 0.25,
            "placed": arm != "off" or seed == 1,
            "finished_s": None if arm == "off" and seed == 0 else 20.0 + seed,  # None counts as 45 s
        }
        for delay_ms in (0.0, 100.0)
        for arm in ("off", "mechanical", "reacting")
        for seed in (0, 1)
    ]
    Table(rows).write_csv(tmp_path / "haptics.csv")
    lines = written("<!-- haptics: by make figures -->\n<!-- end -->", tmp_path).splitlines()
    assert lines[5] == (
        "| wall, 0 ms | 1/2 at 50 (50) | 0/2 | 0/2 | 1 / 2 / 2 | 33.0 / 20.5 / 20.5"
        " | -12.5 [-25.0, +0.0] | -12.5 [-25.0, +0.0] | 25 % / 25 % |"
    )
    # Four pairs of two seeds: as wide as for one delay.
    assert lines[7].startswith("| **wall, all** | 2/4 at 100 (150) | 0/4 | 0/4 | 2 / 4 / 4 |")
    assert "| -12.5 [-25.0, +0.0] |" in lines[7]


def test_the_readme_says_how_fast_overlaps_are_as_the_appendix_does() -> None:
    appendix = (ROOT / "docs/benchmarks.md").read_text(encoding="utf-8")
    times = re.findall(r"^\| times faster than the C\+\+ package.*? \| ([\d.]+) \|", appendix, re.MULTILINE)
    assert len(times) == 2
    assert f"at least {int(min(map(float, times)))} times as fast" in README


def test_the_readme_says_what_haptics_change() -> None:
    if not (FIGURES / "haptics.csv").exists():
        pytest.skip("figures/haptics.csv is missing; make figures measures it")
    trials = read("haptics")
    ahead, shelf = (Table(row for row in trials if (row["scene"] == "shelf") is beside) for beside in (False, True))
    of = len(ahead.where(arm="off"))
    off, on, reacts = (sum(hits > 0 for hits in ahead.where(arm=arm).values("hits")) for arm in ARMS)
    assert f"hits a wall or a post in {off} of {of} trials without haptics, and in {on} of {of} with them" in README
    assert on == reacts
    assert f"At a shelf none of {len(shelf.where(arm='off'))} trials hits anything" in README
    assert sum(shelf.values("hits")) == 0
    cost_s = [float(entry.split()[0]) for entry in [*compared(shelf)][5:7]]
    assert "haptics cost {:.0f} to {:.0f} s".format(*cost_s) in README
