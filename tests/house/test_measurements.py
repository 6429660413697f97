"""The marked tables of docs/ come from stored figures."""

import re
from pathlib import Path

import pytest

from feelahead.lab.measurements import DOCUMENTS, FIGURES, MARKED, TABLES, written
from feelahead.lab.table import Table
from tests.helpers.repository import ROOT

TEXTS = {document.name: document.read_text(encoding="utf-8") for document in DOCUMENTS}
ALL = "\n".join(TEXTS.values())


def test_every_table_stands_between_markers_and_below_the_command_that_make_figures_runs() -> None:
    assert not re.search(r"^\|", MARKED.sub("", TEXTS["measurements.md"]), re.MULTILINE)
    assert [found["name"] for found in MARKED.finditer(ALL)] == [*TABLES]
    asked = dict(re.findall(r"^figures/(\w+)\.csv: asks = (.+)$", (ROOT / "Makefile").read_text(), re.MULTILINE))
    above = re.findall(r"^    feelahead (.+)\n\n<!-- (\w+): by make figures -->$", ALL, re.MULTILINE)
    assert {name: command for command, name in above} == asked
    assert {line.split()[0] for line in (FIGURES / "commits").read_text().splitlines()} == asked.keys()


def test_no_other_document_has_marked_tables() -> None:
    marked = {path for path in (ROOT / "docs").rglob("*.md") if MARKED.search(path.read_text(encoding="utf-8"))}
    assert marked == {*DOCUMENTS}


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_the_tables_are_those_of_the_stored_figures(text: str) -> None:
    assert written(text) == text


def test_a_figure_copied_by_hand_does_not_last(tmp_path: Path) -> None:
    (tmp_path / "commits").write_text("cover 0123abcd\n")
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
    (tmp_path / "commits").write_text("haptics 0123abcd\n")
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
